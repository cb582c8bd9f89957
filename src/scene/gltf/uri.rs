//! URIs of buffers and images: `data:` URIs are decoded, relative paths are checked and resolved.

use super::Resolve;
use super::container::Document;
use super::tidy;
use crate::error::{Error, Result};

/// The bytes that `uri` stands for; `place` is where in the JSON it was found.
pub(super) fn fetch(document: &Document, place: &str, uri: &str, resolve: Resolve) -> Result<Vec<u8>> {
    let bad = |what: String| document.bad(place, what);
    if let Some(data) = uri.strip_prefix("data:") {
        return decode_data(data).map_err(bad);
    }
    let path = relative_path(uri).map_err(|what| bad(format!("'{}' {what}", tidy(uri))))?;
    resolve(&path).map_err(|error| match error {
        // Say which file asked for the one that could not be read.
        Error::Io { path, source } => Error::Io { path: format!("{} ({place}): {path}", document.file), source },
        other => other,
    })
}

/// The part of a data URI after `data:` (RFC 2397).
fn decode_data(data: &str) -> std::result::Result<Vec<u8>, String> {
    let (header, payload) = data.split_once(',').ok_or("the data URI has no comma")?;
    if header.ends_with(";base64") { decode_base64(payload) } else { percent_decode(payload) }
}

/// RFC 4648 base64, with or without padding.
fn decode_base64(text: &str) -> std::result::Result<Vec<u8>, String> {
    let text = text.trim_end_matches('=').as_bytes();
    if text.len() % 4 == 1 {
        return Err("the base64 data is cut off".into());
    }
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for (group, quad) in text.chunks(4).enumerate() {
        let mut bits = 0u32;
        for (i, &symbol) in quad.iter().enumerate() {
            let value = match symbol {
                b'A'..=b'Z' => symbol - b'A',
                b'a'..=b'z' => symbol - b'a' + 26,
                b'0'..=b'9' => symbol - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return Err(format!("byte {} of the base64 data is not base64", group * 4 + i)),
            };
            bits |= u32::from(value) << (18 - 6 * i);
        }
        bytes.extend(bits.to_be_bytes().iter().skip(1).take(quad.len() - 1));
    }
    Ok(bytes)
}

/// Replaces `%41` by `A`.
fn percent_decode(text: &str) -> std::result::Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, tail)) = rest.split_first() {
        rest = tail;
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let digits = tail.get(..2).and_then(|pair| std::str::from_utf8(pair).ok());
        let value = digits.filter(|pair| pair.bytes().all(|digit| digit.is_ascii_hexdigit()));
        let value = value.and_then(|pair| u8::from_str_radix(pair, 16).ok());
        bytes.push(value.ok_or("has a '%' without two hexadecimal digits")?);
        rest = tail.get(2..).unwrap_or_default();
    }
    Ok(bytes)
}

/// The percent-decoded, normalised path, if it stays in the folder of the file that names it.
pub fn relative_path(uri: &str) -> std::result::Result<String, String> {
    let path = String::from_utf8(percent_decode(uri)?).map_err(|_| "is not UTF-8")?;
    if path.contains(|c: char| c.is_control() || c == '\\') {
        return Err("has a backslash or a control character".into());
    }
    if path.starts_with('/') {
        return Err("is an absolute path; only files beside the scene are read".into());
    }
    // A colon in the first segment makes it a scheme (or a drive letter).
    if path.split('/').next().is_some_and(|segment| segment.contains(':')) {
        return Err("is a URL; only files beside the scene are read".into());
    }
    let mut segments: Vec<&str> = Vec::new();
    for segment in path.split('/') {
        match segment {
            "" | "." => {}
            ".." => {
                segments.pop().ok_or("leaves the folder of the scene")?;
            }
            name => segments.push(name),
        }
    }
    if segments.is_empty() { Err("names no file".into()) } else { Ok(segments.join("/")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_rfc_4648() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob")] {
            assert_eq!(decode_base64(text), Ok(bytes.as_bytes().to_vec()), "{text}");
        }
        assert_eq!(decode_base64("//+A"), Ok(vec![255, 255, 128]));
        assert!(decode_base64("Zm9v!").is_err());
        assert!(decode_base64("Zm9vY").is_err());
    }

    #[test]
    fn paths_stay_in_the_folder() {
        assert_eq!(relative_path("./a%20b/../c.png"), Ok("c.png".into()));
        assert_eq!(relative_path("textures/a%20b.png"), Ok("textures/a b.png".into()));
        for bad in ["/etc/x", "../x", "a/../../x", "http://h/x", "C:/x", "%2e%2e/x", "%2Fx", "a\\x", "%00", "%zz", "."]
        {
            assert!(relative_path(bad).is_err(), "{bad}");
        }
    }
}
