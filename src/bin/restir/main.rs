//! The command line: render, compare, and ask what there is.

mod bench;
mod bench_rays;
mod compare;
mod cook;
mod failure;
mod info;
mod lab;
mod options;
mod progress;
mod ray_sets;
mod render;
mod report;
mod scene;
mod scenes;
mod session;
mod techniques;
mod truth;

use clap::{Parser, Subcommand};
use failure::{Failure, Result};
use std::process::ExitCode;

/// ReSTIR on this machine's GPU, or on its CPU through a software Vulkan driver.
///
/// Exit code: 0 done, 1 failed, 2 wrong usage. Errors are one line on stderr: error[CODE]: what.
#[derive(Parser)]
#[command(name = "restir", version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Render(render::Args),
    Compare(compare::Args),
    Techniques(techniques::Args),
    Scenes(scenes::Args),
    Info(info::Args),
    Cook(cook::Args),
    Bench(bench::Args),
    Lab(lab::Args),
    Truth(truth::Args),
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Render(args) => render::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Techniques(args) => techniques::run(&args),
        Command::Scenes(args) => scenes::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Cook(args) => cook::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Lab(args) => lab::run(&args),
        Command::Truth(args) => truth::run(&args),
    }
}

fn main() -> ExitCode {
    match Cli::try_parse().map_err(Failure::Arguments).and_then(|cli| run(cli.command)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
