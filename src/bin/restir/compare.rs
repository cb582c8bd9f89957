//! `restir compare`: how far one picture is from another.

use crate::failure::Result;
use crate::report;
use restir::lab::{self, Bias, Comparison};
use restir::output::read_exr;
use std::path::PathBuf;

/// Compare a picture with a reference: error metrics and signed mean bias.
#[derive(clap::Args)]
pub struct Args {
    /// The picture to judge, linear OpenEXR.
    #[arg(value_name = "A.exr")]
    image: PathBuf,
    /// The reference, linear OpenEXR of the same size.
    #[arg(value_name = "B.exr")]
    reference: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    let comparison = lab::compare(&read_exr(&args.image)?, &read_exr(&args.reference)?)?;
    if args.json { report::json(&comparison) } else { report::text(&table(&comparison)) }
}

fn table(c: &Comparison) -> String {
    let ssim = c.ssim.map_or("- (smaller than its 11x11 window)".to_owned(), |ssim| format!("{ssim:.6}"));
    let mut lines = vec![
        format!("size    {}x{}", c.width, c.height),
        format!("mse     {:.6e}", c.mse),
        format!("rmse    {:.6e}", c.rmse),
        format!("relmse  {:.6e}", c.relmse),
        format!("mape    {:.6}", c.mape),
        format!("ssim    {ssim}"),
        format!("flip    {:.6}", c.flip),
    ];
    let channels = [("red", c.bias.r), ("green", c.bias.g), ("blue", c.bias.b), ("luminance", c.bias.luminance)];
    lines.extend(channels.map(|(name, Bias { absolute, relative })| {
        let relative = relative.map_or(String::new(), |relative| format!("  {:+.4} %", 100.0 * relative));
        format!("bias    {name:9} {absolute:+.6e}{relative}")
    }));
    lines.join("\n")
}
