//! Sun and clear sky: light scattered by the air of a planet like ours, computed when a scene is loaded.
//!
//! Source: Hillaire, "A Scalable and Production Ready Sky and Atmosphere Rendering Technique", EGSR 2020: the medium of
//! its table 1, single scattering by marching, all higher orders as the isotropic series of its section 5.5. The
//! coordinates of the transmittance table are those of Bruneton and Neyret, "Precomputed Atmospheric Scattering", EGSR
//! 2008. Haze is scaled by turbidity (Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight", SIGGRAPH
//! 1999, section 3.1). The three wavelengths 680, 550 and 440 nm stand for red, green and blue.

use super::{Environment, Scene, Sun};
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// Radii of ground and top of the air, in km.
const GROUND: f64 = 6360.0;
const TOP: f64 = 6460.0;

const RAYLEIGH_SCATTERING: DVec3 = DVec3::new(5.802e-3, 13.558e-3, 33.1e-3);
const RAYLEIGH_HEIGHT: f64 = 8.0;
const MIE_HEIGHT: f64 = 1.2;
/// Of the light that haze takes, this part is scattered (table 1: 3.996 of 3.996 + 0.44).
const MIE_ALBEDO: f64 = 3.996 / 4.436;
const MIE_ANISOTROPY: f64 = 0.8;
/// Ångström's exponent 1.3 at 680, 550 and 440 nm, relative to 550 nm.
const MIE_COLOR: DVec3 = DVec3::new(0.759, 1.0, 1.337);
const OZONE_ABSORPTION: DVec3 = DVec3::new(0.650e-3, 1.881e-3, 0.085e-3);
const OZONE_MIDDLE: f64 = 25.0;
const OZONE_HALF_WIDTH: f64 = 15.0;

/// Texels of the map.
const WIDTH: usize = 512;
const HEIGHT: usize = 256;

/// Half the angle under which the sun is seen from the earth, in radians: 16 arc minutes.
pub const SUN_ANGULAR_RADIUS: f32 = 0.004_654;

/// A clear sky and its sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// Degrees of the sun above the horizon, -10 to 90.
    pub elevation: f32,
    /// Degrees from -Z towards +X, -360 to 360.
    pub azimuth: f32,
    /// Optical thickness of air and haze over that of air alone, at 550 nm: 1 clean air, 2 clear, 6 light haze; 1 to 10.
    pub turbidity: f32,
    /// Part of the light that the ground reflects, evenly; 0 to 1.
    pub albedo: f32,
    /// Irradiance of the sun above the air, 0 to 10⁶. With 5 a white ground at noon has a radiance of about 1.
    pub intensity: f32,
}

impl Default for Sky {
    /// The sun behind and to the right of who looks along -Z.
    fn default() -> Self {
        Sky { elevation: 40.0, azimuth: 135.0, turbidity: 2.5, albedo: 0.3, intensity: 5.0 }
    }
}

impl Sky {
    /// Reads `elevation=30,turbidity=4`; what is not named keeps its default. Empty text is the default.
    ///
    /// # Errors
    /// [`Error::Unknown`] for another name, [`Error::BadValue`] for a number out of range.
    pub fn parse(text: &str) -> Result<Self> {
        let mut sky = Sky::default();
        for part in text.split(',').filter(|part| !part.is_empty()) {
            let (name, value) = part.split_once('=').unwrap_or((part, ""));
            let mut fields = sky.fields();
            let Some((_, field, range)) = fields.iter_mut().find(|(known, ..)| *known == name) else {
                let known = fields.map(|(known, ..)| known).join(", ");
                return Err(Error::Unknown { kind: "parameter of the sky", name: name.to_owned(), known });
            };
            let bad = || Error::bad_value(name, format!("'{value}' is not a number from {} to {}", range[0], range[1]));
            **field = value.parse().ok().filter(|v| (range[0]..=range[1]).contains(v)).ok_or_else(bad)?;
        }
        Ok(sky)
    }

    fn fields(&mut self) -> [(&'static str, &mut f32, [f32; 2]); 5] {
        [
            ("elevation", &mut self.elevation, [-10.0, 90.0]),
            ("azimuth", &mut self.azimuth, [-360.0, 360.0]),
            ("turbidity", &mut self.turbidity, [1.0, 10.0]),
            ("albedo", &mut self.albedo, [0.0, 1.0]),
            ("intensity", &mut self.intensity, [0.0, 1e6]),
        ]
    }

    /// Puts this sky and its sun round a scene, in place of its environment and sun.
    pub fn surround(&self, scene: &mut Scene) {
        let air = Air::new(self);
        let (environment, sun) = air.render(self);
        scene.environment = Some(environment);
        scene.sun = Some(sun);
    }

    /// Unit direction towards the sun.
    pub fn sun_direction(&self) -> Vec3 {
        let (elevation, azimuth) = (f64::from(self.elevation).to_radians(), f64::from(self.azimuth).to_radians());
        DVec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), -azimuth.cos() * elevation.cos()).as_vec3()
    }
}

/// The medium at one height, per km.
struct Medium {
    rayleigh: DVec3,
    mie: DVec3,
    extinction: DVec3,
}

/// The air with its two tables.
struct Air {
    /// Extinction of haze on the ground.
    mie_extinction: DVec3,
    albedo: f64,
    transmittance: Table,
    /// All scattering after the first, per unit of the sun's irradiance and of scattering, from all sides alike.
    multiple: Table,
}

/// Values over the unit square, read bilinearly.
struct Table {
    size: [usize; 2],
    values: Vec<DVec3>,
}

impl Table {
    fn new(size: [usize; 2], mut at: impl FnMut(f64, f64) -> DVec3) -> Self {
        let [columns, rows] = size;
        let unit = |i: usize, n: usize| i as f64 / (n - 1) as f64;
        let values = (0..columns * rows).map(|i| at(unit(i % columns, columns), unit(i / columns, rows))).collect();
        Table { size, values }
    }

    fn read(&self, x: f64, y: f64) -> DVec3 {
        let [columns, rows] = self.size;
        let place = |u: f64, n: usize| {
            let p = u.clamp(0.0, 1.0) * (n - 1) as f64;
            let i = (p as usize).min(n - 2);
            (i, p - i as f64)
        };
        let ((i, fx), (j, fy)) = (place(x, columns), place(y, rows));
        let at = |i: usize, j: usize| self.values[j * columns + i];
        at(i, j).lerp(at(i + 1, j), fx).lerp(at(i, j + 1).lerp(at(i + 1, j + 1), fx), fy)
    }
}

/// Distance along a ray from radius `r` with cosine `mu` to the zenith, to the sphere of this radius round the planet's
/// middle: to its far side, or for the ground to its near side, if it is hit.
fn to_top(r: f64, mu: f64) -> f64 {
    (-r * mu + (r * r * (mu * mu - 1.0) + TOP * TOP).max(0.0).sqrt()).max(0.0)
}

fn to_ground(r: f64, mu: f64) -> Option<f64> {
    let discriminant = r * r * (mu * mu - 1.0) + GROUND * GROUND;
    (mu < 0.0 && discriminant >= 0.0).then(|| (-r * mu - discriminant.sqrt()).max(0.0))
}

/// Middle and length of one of `count` steps that grow with distance, as the air thins out.
fn step(length: f64, i: usize, count: usize) -> (f64, f64) {
    let edge = |i: usize| length * (i as f64 / count as f64).powi(2);
    (0.5 * (edge(i) + edge(i + 1)), edge(i + 1) - edge(i))
}

/// Coordinates of the transmittance table (Bruneton and Neyret 2008, section 4).
fn transmittance_place(r: f64, mu: f64) -> [f64; 2] {
    let horizon = (TOP * TOP - GROUND * GROUND).sqrt();
    let rho = (r * r - GROUND * GROUND).max(0.0).sqrt();
    let (nearest, farthest) = (TOP - r, rho + horizon);
    [(to_top(r, mu) - nearest) / (farthest - nearest), rho / horizon]
}

/// The inverse: (r, mu).
fn transmittance_at([x, y]: [f64; 2]) -> [f64; 2] {
    let horizon = (TOP * TOP - GROUND * GROUND).sqrt();
    let rho = horizon * y;
    let r = (rho * rho + GROUND * GROUND).sqrt();
    let (nearest, farthest) = (TOP - r, rho + horizon);
    let d = nearest + x * (farthest - nearest);
    let mu = if d == 0.0 { 1.0 } else { (horizon * horizon - rho * rho - d * d) / (2.0 * r * d) };
    [r, mu.clamp(-1.0, 1.0)]
}

impl Air {
    fn new(sky: &Sky) -> Self {
        // Turbidity is (air + haze) / air, of optical thicknesses: coefficient times scale height.
        let thickness = RAYLEIGH_SCATTERING.y * RAYLEIGH_HEIGHT;
        let haze = (f64::from(sky.turbidity) - 1.0) * thickness / MIE_HEIGHT;
        let none = || Table::new([2, 2], |_, _| DVec3::ZERO);
        let mut air = Air {
            mie_extinction: haze * MIE_COLOR,
            albedo: sky.albedo.into(),
            transmittance: none(),
            multiple: none(),
        };
        air.transmittance = Table::new([256, 64], |x, y| {
            let [r, mu] = transmittance_at([x, y]);
            (-air.optical_depth(r, mu)).exp()
        });
        air.multiple = Table::new([32, 16], |x, y| air.multiple_scattering(GROUND + (TOP - GROUND) * y, 2.0 * x - 1.0));
        air
    }

    fn medium(&self, r: f64) -> Medium {
        let height = r - GROUND;
        let rayleigh = RAYLEIGH_SCATTERING * (-height / RAYLEIGH_HEIGHT).exp();
        let haze = self.mie_extinction * (-height / MIE_HEIGHT).exp();
        let ozone = OZONE_ABSORPTION * (1.0 - (height - OZONE_MIDDLE).abs() / OZONE_HALF_WIDTH).max(0.0);
        Medium { rayleigh, mie: haze * MIE_ALBEDO, extinction: rayleigh + haze + ozone }
    }

    /// To the top of the air, through the ground if need be.
    fn optical_depth(&self, r: f64, mu: f64) -> DVec3 {
        const STEPS: usize = 128;
        let length = to_top(r, mu);
        let along = |i: usize| {
            let (t, step) = step(length, i, STEPS);
            self.medium((r * r + t * t + 2.0 * r * mu * t).sqrt()).extinction * step
        };
        (0..STEPS).map(along).sum()
    }

    /// Of the sun's light, the part that reaches a point.
    fn sunlight(&self, r: f64, mu: f64) -> DVec3 {
        if to_ground(r, mu).is_some() {
            return DVec3::ZERO;
        }
        let [x, y] = transmittance_place(r, mu);
        self.transmittance.read(x, y)
    }

    /// Marches a ray, for a sun of irradiance 1: the light it gathers, and, as if the air shone with 1 per unit of its
    /// scattering, the light it would gather then. `phases` are those of air and haze; both at 1 / 4 pi for light that
    /// has been scattered already, which then comes without its higher orders.
    fn march(&self, r: f64, direction: DVec3, sun: DVec3, steps: usize, phases: Option<[f64; 2]>) -> [DVec3; 2] {
        let start = DVec3::Y * r;
        let ground = to_ground(r, direction.y);
        let length = ground.unwrap_or_else(|| to_top(r, direction.y));
        let mut through = DVec3::ONE;
        let mut gathered = [DVec3::ZERO; 2];
        for i in 0..steps {
            let (t, step) = step(length, i, steps);
            let point = start + direction * t;
            let r = point.length();
            let mu = point.dot(sun) / r;
            let medium = self.medium(r);
            let sunlight = self.sunlight(r, mu);
            let scattering = medium.rayleigh + medium.mie;
            let [rayleigh, mie] = phases.unwrap_or([1.0 / (2.0 * TAU); 2]);
            let mut source = sunlight * (medium.rayleigh * rayleigh + medium.mie * mie);
            if phases.is_some() {
                source += scattering * self.multiple.read(0.5 * (mu + 1.0), (r - GROUND) / (TOP - GROUND));
            }
            let passed = (-medium.extinction * step).exp();
            // The exact integral over a step of even air.
            let weight = through * (DVec3::ONE - passed) / medium.extinction.max(DVec3::splat(1e-12));
            gathered[0] += weight * source;
            gathered[1] += weight * scattering;
            through *= passed;
        }
        if let (Some(length), None) = (ground, phases) {
            let point = start + direction * length;
            let mu = point.dot(sun) / point.length();
            gathered[0] += through * self.sunlight(GROUND, mu) * (mu.max(0.0) * self.albedo / PI);
        }
        gathered
    }

    /// Hillaire 2020, section 5.5: second-order light over 1 - f, the sum of the series of what is scattered on.
    fn multiple_scattering(&self, r: f64, mu_sun: f64) -> DVec3 {
        const SIDE: usize = 8;
        let sun = DVec3::new((1.0 - mu_sun * mu_sun).max(0.0).sqrt(), mu_sun, 0.0);
        let mut sums = [DVec3::ZERO; 2];
        for i in 0..SIDE * SIDE {
            let (u, v) = (((i % SIDE) as f64 + 0.5) / SIDE as f64, ((i / SIDE) as f64 + 0.5) / SIDE as f64);
            let y: f64 = 1.0 - 2.0 * v;
            let (sin, cos) = (TAU * u).sin_cos();
            let across = (1.0 - y * y).sqrt();
            let gathered = self.march(r, DVec3::new(across * cos, y, across * sin), sun, 20, None);
            // The isotropic phase, 1 / 4 pi, over all directions, 4 pi: their mean.
            sums[0] += gathered[0] / (SIDE * SIDE) as f64;
            sums[1] += gathered[1] / (SIDE * SIDE) as f64;
        }
        sums[0] / (DVec3::ONE - sums[1])
    }

    fn render(&self, sky: &Sky) -> (Environment, Sun) {
        let sun = sky.sun_direction().as_dvec3();
        let intensity = f64::from(sky.intensity);
        let mut pixels = vec![DVec3::ZERO; WIDTH * HEIGHT];
        let mut from_sky = DVec3::ZERO;
        for row in 0..HEIGHT / 2 {
            let v = (row as f64 + 0.5) / HEIGHT as f64;
            let (sin, cos) = (PI * v).sin_cos();
            for column in 0..WIDTH {
                let (x, z) = (TAU * ((column as f64 + 0.5) / WIDTH as f64 - 0.5)).sin_cos();
                let direction = DVec3::new(sin * x, cos, -sin * z);
                let cosine = direction.dot(sun);
                let phases = Some([rayleigh_phase(cosine), mie_phase(cosine)]);
                let radiance = intensity * self.march(GROUND, direction, sun, 32, phases)[0];
                pixels[row * WIDTH + column] = radiance;
                let solid_angle = sin * (PI / HEIGHT as f64) * (TAU / WIDTH as f64);
                from_sky += radiance * (cos * solid_angle);
            }
        }
        let irradiance = intensity * self.sunlight(GROUND, sun.y);
        let ground = (from_sky + irradiance * sun.y.max(0.0)) * (self.albedo / PI);
        pixels[WIDTH * HEIGHT / 2..].fill(ground);
        let environment = Environment {
            width: WIDTH as u32,
            height: HEIGHT as u32,
            pixels: pixels.iter().map(|p| p.as_vec3().to_array()).collect(),
        };
        let sun =
            Sun { direction: sun.as_vec3(), irradiance: irradiance.as_vec3(), angular_radius: SUN_ANGULAR_RADIUS };
        (environment, sun)
    }
}

fn rayleigh_phase(cosine: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// Cornette and Shanks 1992.
fn mie_phase(cosine: f64) -> f64 {
    let g = MIE_ANISOTROPY;
    let g2 = g * g;
    3.0 / (8.0 * PI) * (1.0 - g2) * (1.0 + cosine * cosine) / ((2.0 + g2) * (1.0 + g2 - 2.0 * g * cosine).powf(1.5))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rendered(text: &str) -> (Environment, Sun, Sky) {
        let sky = Sky::parse(text).unwrap();
        let (environment, sun) = Air::new(&sky).render(&sky);
        (environment, sun, sky)
    }

    /// Irradiance of a level plate from the map alone, by quadrature.
    fn from_sky(environment: &Environment) -> DVec3 {
        let upper = environment.pixels.iter().enumerate().take(WIDTH * HEIGHT / 2);
        upper
            .map(|(i, pixel)| {
                let theta = PI * ((i / WIDTH) as f64 + 0.5) / HEIGHT as f64;
                let solid_angle = theta.sin() * PI / HEIGHT as f64 * TAU / WIDTH as f64;
                Vec3::from(*pixel).as_dvec3() * solid_angle * theta.cos()
            })
            .sum()
    }

    /// Straight up the air is as thick as its layers: coefficient times scale height, less the part above the top, and
    /// half the width times the height of ozone's triangle.
    #[test]
    fn the_sun_at_the_zenith_is_dimmed_by_the_layers() {
        for turbidity in [1.0, 3.0, 8.0] {
            let (_, sun, sky) = rendered(&format!("elevation=90,turbidity={turbidity},intensity=1"));
            let layer = |height: f64| height * (1.0 - (-(TOP - GROUND) / height).exp());
            let haze = (f64::from(sky.turbidity) - 1.0) * RAYLEIGH_SCATTERING.y * RAYLEIGH_HEIGHT / MIE_HEIGHT;
            let depth = RAYLEIGH_SCATTERING * layer(RAYLEIGH_HEIGHT)
                + MIE_COLOR * haze * layer(MIE_HEIGHT)
                + OZONE_ABSORPTION * OZONE_HALF_WIDTH;
            let expected = (-depth).exp();
            let error = (sun.irradiance.as_dvec3() / expected - 1.0).abs().max_element();
            assert!(error < 2e-3, "turbidity {turbidity}: {} is not {expected}", sun.irradiance);
        }
    }

    #[test]
    fn phases_are_densities() {
        let steps = 20_000;
        let integral = |phase: fn(f64) -> f64| -> f64 {
            (0..steps).map(|i| phase((f64::from(i) + 0.5) / f64::from(steps) * 2.0 - 1.0)).sum::<f64>() * 2.0 * TAU
                / f64::from(steps)
        };
        for phase in [rayleigh_phase, mie_phase] {
            assert!((integral(phase) - 1.0).abs() < 1e-4, "{}", integral(phase));
        }
    }

    /// On both sides of the plane through sun and zenith the sky is the same, and a sun elsewhere turns it.
    #[test]
    fn the_sky_is_symmetric_and_follows_the_sun() {
        let (map, ..) = rendered("elevation=25,azimuth=0");
        let (turned, ..) = rendered("elevation=25,azimuth=90");
        for row in 0..HEIGHT {
            for column in 0..WIDTH {
                let at = |map: &Environment, column: usize| Vec3::from(map.pixels[row * WIDTH + column % WIDTH]);
                let (left, right) = (at(&map, column), at(&map, WIDTH - 1 - column));
                assert!((left - right).abs().max_element() <= 1e-5 * left.max_element(), "{column} {row}");
                let moved = at(&turned, column + WIDTH / 4);
                assert!((left - moved).abs().max_element() <= 1e-5 * left.max_element(), "{column} {row}");
            }
        }
    }

    /// No more light comes down than went in, but not much less; most of it straight from the sun; blue at noon; and what
    /// the ground sends back comes down again in part.
    #[test]
    fn energy_is_plausible() {
        for elevation in [5.0f64, 30.0, 90.0] {
            for turbidity in [1.5, 4.0] {
                let name = format!("elevation={elevation},turbidity={turbidity},intensity=1,albedo=0");
                let (map, sun, _) = rendered(&name);
                let up = elevation.to_radians().sin();
                let (direct, diffuse) = (sun.irradiance.as_dvec3() * up, from_sky(&map));
                let global = direct + diffuse;
                println!("{name}: direct {direct:.3} diffuse {diffuse:.3} of {up:.3}");
                assert!(global.max_element() < up, "{name}: {global} of {up}");
                assert!(elevation < 30.0 || global.y > 0.6 * up, "{name}: {global} of {up}");
                assert!(elevation < 30.0 || direct.y > diffuse.y, "{name}: {direct} {diffuse}");
                assert!(diffuse.z > diffuse.x || elevation < 30.0, "{name}: not blue: {diffuse}");
                let (snow, ..) = rendered(&name.replace("albedo=0", "albedo=0.8"));
                assert!(elevation < 30.0 || from_sky(&snow).y > 1.02 * diffuse.y, "{name}: the ground lights the sky");
            }
        }
    }

    /// Under a clear sky the diffuse part of the light by day lies between a tenth and three tenths.
    #[test]
    fn the_ground_reflects_what_falls_on_it() {
        let (map, sun, sky) = rendered("elevation=50,turbidity=2.5,albedo=0.5");
        let up = f64::from(sky.elevation).to_radians().sin();
        let (direct, diffuse) = (sun.irradiance.as_dvec3() * up, from_sky(&map));
        let part = diffuse.y / (direct + diffuse).y;
        assert!((0.1..0.3).contains(&part), "{part}");
        let ground = Vec3::from(map.pixels[WIDTH * HEIGHT - 1]).as_dvec3();
        assert!((ground / ((direct + diffuse) * 0.5 / PI) - 1.0).abs().max_element() < 1e-4, "{ground}");
    }

    #[test]
    fn the_sun_sets() {
        let irradiance = |elevation: f32| rendered(&format!("elevation={elevation}")).1.irradiance;
        assert_eq!(irradiance(-1.0), Vec3::ZERO);
        let (low, high) = (irradiance(3.0), irradiance(60.0));
        assert!(low.x > 2.0 * low.z && high.x < 1.5 * high.z, "{low} {high}");
        let (dusk, _, _) = rendered("elevation=-4");
        let brightest = dusk.pixels.iter().flatten().fold(0f32, |a, &b| a.max(b));
        assert!(brightest > 0.0 && brightest < 0.5, "{brightest}");
    }

    #[test]
    fn parses_or_says_why_not() {
        assert_eq!(Sky::parse("").unwrap(), Sky::default());
        let sky = Sky::parse("elevation=-4,turbidity=3.5").unwrap();
        assert_eq!((sky.elevation, sky.turbidity, sky.albedo), (-4.0, 3.5, Sky::default().albedo));
        for (text, code) in [
            ("height=3", "UNKNOWN_NAME"),
            ("elevation=91", "BAD_VALUE"),
            ("elevation=nan", "BAD_VALUE"),
            ("albedo", "BAD_VALUE"),
            ("turbidity=0", "BAD_VALUE"),
        ] {
            assert_eq!(Sky::parse(text).unwrap_err().code(), code, "{text}");
        }
    }
}
