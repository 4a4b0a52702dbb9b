//! What kernels take of a graphics processor's registers, by the compiler of Mesa's driver for AMD, which needs no processor.
//!
//! Registers that do not suffice are spilled to memory, and those that a lane takes decide how many lanes wait for memory at once.
//! `cargo bench --bench kernels` prints the whole table.

use crate::common::radv::{self, FAMILIES};

tests! {
    kernels_fit_the_registers_of_graphics_processors: radv full,
}

/// What kernels whose names have these whole words, and end so, may take at most on each processor of [`FAMILIES`].
struct Bar {
    kernels: &'static str,
    end: &'static str,
    /// Vector registers of a lane.
    vectors: [u64; 3],
    /// Those that are spilled.
    spilled: [u64; 3],
}

/// As Mesa 22.3 compiles them. A wave of 128 vector registers runs beside seven others on a SIMD of navi21. The first that fits a kernel
/// holds for it.
const BARS: [Bar; 12] = [
    bar("drive: by axle, magic formula", [168, 132, 164], [0, 33, 0]).of("hills"),
    bar("line: open, 0 terms", [64, 60, 64], [0; 3]).of("hills"),
    bar("line: ", [48, 48, 48], [0; 3]).of("hills"),
    bar("by axle, linear", [120, 120, 116], [0; 3]).of("hills"),
    bar("energy_line: ", [80, 84, 84], [0; 3]).of("hills"),
    bar("replay: by axle, magic formula", [120, 120, 120], [0; 3]),
    bar("settle: by axle, magic formula", [128, 132, 124], [0; 3]),
    bar("drive: by axle, magic formula", [160, 132, 160], [0, 30, 0]),
    bar("by axle, linear", [120, 120, 112], [0; 3]),
    bar("line: ", [40, 48, 36], [0; 3]),
    bar("energy_line: ", [64, 60, 64], [0; 3]),
    bar("replay_reduce: by axle", [16, 24, 16], [0; 3]),
];
/// Spilled scalar registers, on all of them. The driver keeps these in lanes of a vector register, so that few do no harm.
const SPILLED_SCALARS: u64 = 9;

const fn bar(kernels: &'static str, vectors: [u64; 3], spilled: [u64; 3]) -> Bar {
    Bar {
        kernels,
        end: "",
        vectors,
        spilled,
    }
}

impl Bar {
    /// The same for kernels whose names end so.
    const fn of(self, end: &'static str) -> Self {
        Self { end, ..self }
    }

    fn fits(&self, kernel: &str) -> bool {
        format!(" {kernel}").contains(&format!(" {}", self.kernels)) && kernel.ends_with(self.end)
    }
}

fn kernels_fit_the_registers_of_graphics_processors() {
    let mut beyond = Vec::new();
    for (place, family) in FAMILIES.into_iter().enumerate() {
        let answer = radv::ask(family, &BARS.map(|bar| bar.kernels)).expect("RADV compiles");
        for (at, bar) in BARS.iter().enumerate() {
            let fitting = || {
                answer.kernels.iter().filter(|kernel| {
                    let first = BARS.iter().position(|bar| bar.fits(&kernel.name()));
                    first == Some(at)
                })
            };
            assert!(
                fitting().count() > 0,
                "no kernel is called {} {}",
                bar.kernels,
                bar.end
            );
            for kernel in fitting() {
                let found = ["VGPRs", "Spilled VGPRs", "Spilled SGPRs"].map(|name| kernel.figure(name));
                let most = [bar.vectors[place], bar.spilled[place], SPILLED_SCALARS];
                println!("{family}, {}: {found:?} of {most:?}", kernel.name());
                if found.iter().zip(most).any(|(found, most)| *found > most) {
                    beyond.push(format!(
                        "{family}, {}: {found:?}, at most {most:?}",
                        kernel.name()
                    ));
                }
            }
        }
    }
    assert!(
        beyond.is_empty(),
        "vector registers, spilled ones and spilled scalar registers:\n{}",
        beyond.join("\n")
    );
}
