//! Compiles the table of shaders to `shaders/spirv`; with `--check` only says which are out of date.

use std::process::ExitCode;

use q3rays::gpu::shader_compiler::{compile_table, source_root};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let check = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => false,
        ["--check"] => true,
        _ => {
            eprintln!("usage: compile_shaders [--check]");
            return ExitCode::from(2);
        }
    };
    match compile_table(&source_root(), check) {
        Ok(changed) if changed.is_empty() => ExitCode::SUCCESS,
        Ok(changed) if check => {
            eprintln!("out of date: {}; run compile_shaders", changed.join(", "));
            ExitCode::FAILURE
        }
        Ok(changed) => {
            println!("compiled: {}", changed.join(", "));
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
