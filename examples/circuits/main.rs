//! Writes ten made circuits in the racetrack database's format, and a sweep over them.
//!
//! `cargo run --release --example circuits -- circuits`, then `lapswarm sweep circuits/sweep.toml`

#[allow(dead_code)] // Tests also draw random ones.
mod shapes;

use shapes::Circuit;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "circuits".to_owned());
    std::fs::create_dir_all(&folder)?;
    for circuit in Circuit::ten() {
        let file = format!("{folder}/{}.csv", circuit.name);
        std::fs::write(&file, circuit.csv())?;
        println!("{file}");
    }
    let names = Circuit::ten()
        .into_iter()
        .map(|circuit| format!("\"{}.csv\"", circuit.name));
    let names: Vec<String> = names.collect();
    let sweep = format!(
        "study = \"raceline\"\n\n[base]\nobjectives = [\"lap_time\"]\n\n[grid]\ntrack = [{}]\n",
        names.join(", ")
    );
    std::fs::write(format!("{folder}/sweep.toml"), sweep)?;
    println!("{folder}/sweep.toml");
    Ok(())
}
