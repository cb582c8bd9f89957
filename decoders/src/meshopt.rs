//! The bitstreams of `EXT_meshopt_compression` and `KHR_meshopt_compression`, written from the latter's specification
//! (appendix A, the codecs; appendix B, the filters), of which the former is version 0.

use crate::{Result, broken};

/// How elements were compressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// Byte-wise differences of neighbouring elements.
    Attributes,
    /// Indices of a triangle list.
    Triangles,
    /// Other indices.
    Indices,
}

/// What is done to decoded attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filter {
    /// Nothing.
    None,
    /// Unit vectors from the octahedron.
    Octahedral,
    /// Unit quaternions without their largest component.
    Quaternion,
    /// Floats of 24 bits of mantissa and 8 of exponent.
    Exponential,
    /// RGBA from YCoCg.
    Color,
}

/// What a compressed buffer view says about itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// How it was compressed.
    pub mode: Mode,
    /// What to do after.
    pub filter: Filter,
    /// Number of elements.
    pub count: usize,
    /// Bytes of an element.
    pub stride: usize,
}

impl Layout {
    /// The layout of the extension's strings, where it is one that the specification allows.
    ///
    /// # Errors
    /// [`Fault::Broken`](crate::Fault::Broken) with the rule that is broken.
    pub fn new(mode: &str, filter: &str, count: usize, stride: usize) -> Result<Layout> {
        let mode = match mode {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            _ => return Err(broken("its mode is none of ATTRIBUTES, TRIANGLES, INDICES")),
        };
        let filter = match filter {
            "NONE" => Filter::None,
            "OCTAHEDRAL" => Filter::Octahedral,
            "QUATERNION" => Filter::Quaternion,
            "EXPONENTIAL" => Filter::Exponential,
            "COLOR" => Filter::Color,
            _ => return Err(broken("its filter is none of NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL, COLOR")),
        };
        let strides = match mode {
            Mode::Attributes => stride.is_multiple_of(4) && (4..=256).contains(&stride),
            Mode::Triangles | Mode::Indices => stride == 2 || stride == 4,
        };
        let filters = match filter {
            Filter::None | Filter::Exponential => true,
            Filter::Octahedral | Filter::Color => stride == 4 || stride == 8,
            Filter::Quaternion => stride == 8,
        };
        if !strides || !filters {
            return Err(broken(format!("its mode or filter does not allow elements of {stride} bytes")));
        }
        if mode != Mode::Attributes && filter != Filter::None {
            return Err(broken("indices have no filter"));
        }
        if mode == Mode::Triangles && !count.is_multiple_of(3) {
            return Err(broken(format!("{count} indices are no whole triangles")));
        }
        Ok(Layout { mode, filter, count, stride })
    }
}

/// Decompresses a buffer view: `count * stride` bytes. The caller bounds that product; it is not allocated where `bytes`
/// are too few to describe it.
///
/// # Errors
/// [`Fault::Broken`](crate::Fault::Broken) for a stream that ends early or late, or breaks a rule.
pub fn decode(bytes: &[u8], layout: &Layout) -> Result<Vec<u8>> {
    match layout.mode {
        Mode::Attributes => {
            let mut elements = attributes(bytes, layout.count, layout.stride)?;
            filter(&mut elements, layout.filter, layout.stride);
            Ok(elements)
        }
        Mode::Triangles => triangles(bytes, layout.count).map(|indices| pack(&indices, layout.stride)),
        Mode::Indices => indices(bytes, layout.count).map(|indices| pack(&indices, layout.stride)),
    }
}

/// Indices as 16 or 32 bits.
fn pack(indices: &[u32], stride: usize) -> Vec<u8> {
    indices.iter().flat_map(|index| index.to_le_bytes().into_iter().take(stride)).collect()
}

/// Bytes that are read in order.
struct Stream<'a> {
    rest: &'a [u8],
}

impl<'a> Stream<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(|| broken("the compressed data end early"))?;
        self.rest = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8> {
        self.take(1).map(|byte| byte.first().copied().unwrap_or_default())
    }

    /// Unsigned LEB128 of at most five bytes.
    fn varint(&mut self) -> Result<u32> {
        let mut value = 0u32;
        for shift in [0, 7, 14, 21, 28] {
            let byte = self.byte()?;
            value |= u32::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(broken("a compressed number is longer than five bytes"))
    }

    fn end(&self) -> Result<()> {
        if self.rest.is_empty() { Ok(()) } else { Err(broken("the compressed data do not end where they should")) }
    }
}

/// Elements of a group: deltas are packed sixteen at a time.
const GROUP: usize = 16;

/// Mode 0.
fn attributes(bytes: &[u8], count: usize, stride: usize) -> Result<Vec<u8>> {
    let (&header, body) = bytes.split_first().ok_or_else(|| broken("the compressed data are empty"))?;
    let channels = stride / 4;
    let (version, tail, padded) = match header {
        0xa0 => (0, stride, stride.max(32)),
        0xa1 => (1, stride + channels, (stride + channels).max(24)),
        _ => return Err(broken(format!("compressed attributes begin with {header:#04x}, not 0xa0 or 0xa1"))),
    };
    let padding = body.len().checked_sub(padded).ok_or_else(|| broken("the compressed data end early"))?;
    let (body, end) = body.split_at(padding);
    let (baseline, modes) = end.split_at(padded - tail).1.split_at(stride);
    let block_elements = (8192 / stride / GROUP * GROUP).min(256);
    // The least that a block takes: its control header, or a header of two bits a group and byte.
    let least = |elements: usize| match version {
        0 => stride * elements.div_ceil(4 * GROUP),
        _ => channels,
    };
    let (whole, remaining) = (count / block_elements, count % block_elements);
    let needed = whole as u64 * least(block_elements) as u64 + if remaining > 0 { least(remaining) as u64 } else { 0 };
    if needed > body.len() as u64 {
        return Err(broken(format!("{} bytes cannot hold {count} elements of {stride} bytes", bytes.len())));
    }

    let mut stream = Stream { rest: body };
    let mut previous: Vec<u8> = baseline.to_vec();
    let mut out = vec![0; count * stride];
    let mut deltas = vec![[0u8; 256]; stride];
    for block in out.chunks_mut(block_elements * stride) {
        let elements = block.len() / stride;
        let control = if version == 1 { stream.take(channels)? } else { &[] };
        for (byte, deltas) in deltas.iter_mut().enumerate() {
            let control = control.get(byte / 4).map(|packed| packed >> (byte % 4 * 2) & 3);
            data_block(&mut stream, control, elements, deltas)?;
        }
        for channel in 0..channels {
            let mode = modes.get(channel).copied().unwrap_or_default();
            channel_deltas(block, &mut previous, &deltas, stride, channel, mode)?;
        }
    }
    stream.end()?;
    Ok(out)
}

/// The deltas of one byte of up to 256 elements. Without `control` it is version 0.
fn data_block(stream: &mut Stream, control: Option<u8>, elements: usize, deltas: &mut [u8; 256]) -> Result<()> {
    let widths = match control {
        None => [0, 2, 4, 8],
        Some(0) => [0, 1, 2, 4],
        Some(1) => [1, 2, 4, 8],
        Some(2) => {
            deltas.fill(0);
            return Ok(());
        }
        Some(_) => {
            let literal = stream.take(elements)?;
            deltas[..elements].copy_from_slice(literal);
            return Ok(());
        }
    };
    let groups = elements.div_ceil(GROUP);
    let header = stream.take(groups.div_ceil(4))?;
    for (group, deltas) in deltas.chunks_exact_mut(GROUP).take(groups).enumerate() {
        let mode = header.get(group / 4).map_or(0, |packed| packed >> (group % 4 * 2) & 3);
        match widths[usize::from(mode)] {
            0 => deltas.fill(0),
            8 => deltas.copy_from_slice(stream.take(GROUP)?),
            width => sentinels(stream, width, deltas)?,
        }
    }
    Ok(())
}

/// Sixteen deltas of `width` bits; one with all bits set stands for a whole byte that follows.
fn sentinels(stream: &mut Stream, width: usize, deltas: &mut [u8]) -> Result<()> {
    let packed = stream.take(GROUP * width / 8)?;
    let (sentinel, per_byte) = ((1u8 << width) - 1, 8 / width);
    for (i, delta) in deltas.iter_mut().enumerate() {
        let byte = packed.get(i / per_byte).copied().unwrap_or_default();
        // Single bits are stored from the lowest on, pairs and quads from the highest.
        let place = if width == 1 { i % 8 } else { per_byte - 1 - i % per_byte };
        let bits = byte >> (place * width) & sentinel;
        *delta = if bits == sentinel { stream.byte()? } else { bits };
    }
    Ok(())
}

/// Adds up the deltas of four bytes of every element of a block.
fn channel_deltas(
    block: &mut [u8],
    previous: &mut [u8],
    deltas: &[[u8; 256]],
    stride: usize,
    channel: usize,
    mode: u8,
) -> Result<()> {
    let first = channel * 4;
    let (Some(deltas), Some(previous)) = (deltas.get(first..first + 4), previous.get_mut(first..first + 4)) else {
        return Ok(());
    };
    let rotation = match (mode & 15, mode >> 4) {
        (0 | 1, 0) => 0,
        (2, rotation) => u32::from(rotation),
        _ => return Err(broken(format!("an unknown channel mode {mode:#04x}"))),
    };
    for (i, element) in block.chunks_exact_mut(stride).enumerate() {
        let delta: [u8; 4] = std::array::from_fn(|byte| deltas[byte][i]);
        let before = [previous[0], previous[1], previous[2], previous[3]];
        let value = match mode & 15 {
            0 => std::array::from_fn(|byte| {
                let zigzag = delta[byte];
                before[byte].wrapping_add(if zigzag & 1 != 0 { !(zigzag >> 1) } else { zigzag >> 1 })
            }),
            1 => {
                let half = |at: usize| {
                    let zigzag = u16::from_le_bytes([delta[at], delta[at + 1]]);
                    let delta = if zigzag & 1 != 0 { !(zigzag >> 1) } else { zigzag >> 1 };
                    u16::from_le_bytes([before[at], before[at + 1]]).wrapping_add(delta).to_le_bytes()
                };
                let (low, high) = (half(0), half(2));
                [low[0], low[1], high[0], high[1]]
            }
            _ => (u32::from_le_bytes(before) ^ u32::from_le_bytes(delta).rotate_left(rotation)).to_le_bytes(),
        };
        element[first..first + 4].copy_from_slice(&value);
        previous.copy_from_slice(&value);
    }
    Ok(())
}

/// The last sixteen of something; entry 0 is the newest.
struct Fifo<T> {
    entries: [Option<T>; 16],
    next: usize,
}

impl<T: Copy> Fifo<T> {
    fn new() -> Self {
        Fifo { entries: [None; 16], next: 0 }
    }

    fn push(&mut self, entry: T) {
        self.entries[self.next] = Some(entry);
        self.next = (self.next + 1) % 16;
    }

    fn get(&self, age: usize) -> Result<T> {
        let entry = self.entries[(self.next + 31 - age % 16) % 16];
        entry.ok_or_else(|| broken("a triangle refers to one before the first"))
    }
}

/// What decoding triangles remembers.
struct Triangles<'a> {
    data: Stream<'a>,
    next: u32,
    last: u32,
    vertices: Fifo<u32>,
}

impl Triangles<'_> {
    /// The next vertex that was never used before.
    fn fresh(&mut self) -> u32 {
        let index = self.next;
        self.next = self.next.wrapping_add(1);
        index
    }

    /// A vertex given by its distance from the last one given so.
    fn explicit(&mut self) -> Result<u32> {
        let zigzag = self.data.varint()?;
        let delta = if zigzag & 1 != 0 { !(zigzag >> 1) } else { zigzag >> 1 };
        self.last = self.last.wrapping_add(delta);
        Ok(self.last)
    }

    /// The second or third vertex of a triangle without a known edge, and whether it is new.
    fn corner(&mut self, code: u8) -> Result<(u32, bool)> {
        match code {
            0 => Ok((self.fresh(), true)),
            15 => Ok((self.explicit()?, true)),
            age => Ok((self.vertices.get(usize::from(age) - 1)?, false)),
        }
    }
}

/// Mode 1.
fn triangles(bytes: &[u8], count: usize) -> Result<Vec<u32>> {
    let (&header, body) = bytes.split_first().ok_or_else(|| broken("the compressed data are empty"))?;
    if header != 0xe1 {
        return Err(broken(format!("compressed triangles begin with {header:#04x}, not 0xe1")));
    }
    let mut stream = Stream { rest: body };
    let codes = stream.take(count / 3)?;
    let table_at = stream.rest.len().checked_sub(16).ok_or_else(|| broken("the compressed data end early"))?;
    let (data, table) = stream.rest.split_at(table_at);
    if table[14..] != [0, 0] || table.iter().any(|code| code & 15 == 15 || code >> 4 == 15) {
        return Err(broken("the table of compressed triangles is not valid"));
    }
    let mut state = Triangles { data: Stream { rest: data }, next: 0, last: 0, vertices: Fifo::new() };
    let mut edges: Fifo<(u32, u32)> = Fifo::new();
    let mut out = Vec::with_capacity(codes.len() * 3);
    for &code in codes {
        let (high, low) = (code >> 4, code & 15);
        let [a, b, c] = if high < 15 {
            let (a, b) = edges.get(usize::from(high))?;
            let c = match low {
                0 => state.fresh(),
                13 => state.last.wrapping_sub(1),
                14 => state.last.wrapping_add(1),
                15 => state.explicit()?,
                age => state.vertices.get(usize::from(age))?,
            };
            if low == 13 || low == 14 {
                state.last = c;
            }
            if low == 0 || low >= 13 {
                state.vertices.push(c);
            }
            edges.push((c, b));
            edges.push((a, c));
            [a, b, c]
        } else {
            let corners = if low < 14 { table[usize::from(low)] } else { state.data.byte()? };
            if low >= 14 && corners == 0 {
                state.next = 0;
            }
            let a = if low == 15 { state.explicit()? } else { state.fresh() };
            let (b, new_b) = state.corner(corners >> 4)?;
            let (c, new_c) = state.corner(corners & 15)?;
            edges.push((b, a));
            edges.push((c, b));
            edges.push((a, c));
            for vertex in [Some(a), new_b.then_some(b), new_c.then_some(c)].into_iter().flatten() {
                state.vertices.push(vertex);
            }
            [a, b, c]
        };
        out.extend([a, b, c]);
    }
    state.data.end()?;
    Ok(out)
}

/// Mode 2.
fn indices(bytes: &[u8], count: usize) -> Result<Vec<u32>> {
    let (&header, body) = bytes.split_first().ok_or_else(|| broken("the compressed data are empty"))?;
    if header != 0xd1 {
        return Err(broken(format!("compressed indices begin with {header:#04x}, not 0xd1")));
    }
    let end = body.len().checked_sub(4).ok_or_else(|| broken("the compressed data end early"))?;
    if count > end {
        return Err(broken(format!("{} bytes cannot hold {count} indices", bytes.len())));
    }
    let mut stream = Stream { rest: &body[..end] };
    let mut last = [0u32; 2];
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let value = stream.varint()?;
        let baseline = &mut last[(value & 1) as usize];
        *baseline = baseline.wrapping_add(if value & 2 != 0 { !(value >> 2) } else { value >> 2 });
        out.push(*baseline);
    }
    stream.end()?;
    Ok(out)
}

/// Signed or unsigned integers of 8 or 16 bits, four to an element.
fn each_quad(elements: &mut [u8], stride: usize, mut change: impl FnMut([i32; 4], i32) -> [i32; 4]) {
    for element in elements.chunks_exact_mut(stride) {
        match element {
            [x, y, z, w] => {
                let quad = [*x, *y, *z, *w].map(|byte| i32::from(byte as i8));
                [*x, *y, *z, *w] = change(quad, 127).map(|value| value as u8);
            }
            [x0, x1, y0, y1, z0, z1, w0, w1] => {
                let quad = [[*x0, *x1], [*y0, *y1], [*z0, *z1], [*w0, *w1]];
                let quad = quad.map(|bytes| i32::from(i16::from_le_bytes(bytes)));
                let quad = change(quad, 32767).map(|value| (value as u16).to_le_bytes());
                [[*x0, *x1], [*y0, *y1], [*z0, *z1], [*w0, *w1]] = quad;
            }
            _ => {}
        }
    }
}

/// Appendix B. A file that breaks a filter's rules gets numbers without meaning, as the specification allows.
fn filter(elements: &mut [u8], filter: Filter, stride: usize) {
    match filter {
        Filter::None => {}
        Filter::Octahedral => each_quad(elements, stride, |[x, y, one, w], largest| {
            let (x, y) = (x as f32 / one as f32, y as f32 / one as f32);
            let z = 1.0 - x.abs() - y.abs();
            let t = z.min(0.0);
            let (x, y) = (x - t.copysign(x), y - t.copysign(y));
            let length = (x * x + y * y + z * z).sqrt();
            let unit = |v: f32| (v / length * largest as f32).round() as i32;
            [unit(x), unit(y), unit(z), w]
        }),
        Filter::Quaternion => each_quad(elements, stride, |[x, y, z, w], _| {
            let scale = std::f32::consts::FRAC_1_SQRT_2 / (w | 3) as f32;
            let [x, y, z] = [x, y, z].map(|v| v as f32 * scale);
            let largest = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
            let [x, y, z, largest] = [x, y, z, largest].map(|v| (v * 32767.0).round() as i32);
            let mut out = [0; 4];
            for (turn, value) in [largest, x, y, z].into_iter().enumerate() {
                out[((w & 3) as usize + turn) % 4] = value;
            }
            out
        }),
        Filter::Exponential => {
            for word in elements.as_chunks_mut::<4>().0 {
                let value = i32::from_le_bytes(*word);
                let (exponent, mantissa) = (value >> 24, value << 8 >> 8);
                // Exact: a power of two, and 24 bits of mantissa, in f64.
                let power = f64::from_bits(((1023 + i64::from(exponent)) as u64) << 52);
                *word = ((f64::from(mantissa) * power) as f32).to_le_bytes();
            }
        }
        Filter::Color => each_quad(elements, stride, |quad, largest| {
            let unsigned = 2 * largest + 1;
            let [y, alpha] = [quad[0], quad[3]].map(|v| v & unsigned);
            let (co, cg) = (quad[1], quad[2]);
            let scale = (1i32 << (32 - alpha.leading_zeros())) - 1;
            let alpha = alpha & (scale >> 1);
            let alpha = alpha << 1 | alpha & 1;
            let widen = |v: i32| (v as f32 * (unsigned as f32 / scale as f32)).round() as i32;
            [widen(y + co - cg), widen(y + cg), widen(y - co - cg), widen(alpha)]
        }),
    }
}
