//! The recipes of the book's tutorials, typed as they stand: they end well and print what the book says.

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;

/// Tutorials whose commands run one after the other in one folder. The others take long, are about the machine's speed, need files of
/// one's own, or search where a figure in the last place leads elsewhere (`identify`).
const TUTORIALS: [&[&str]; 5] = [
    &["raceline", "hybrid"],
    &["transient", "report"],
    &["envelope"],
    &["sensitivity"],
    &["surface"],
];

/// What lines say that tell of the machine: its instruction set, and how fast it is.
const OF_THE_MACHINE: [&str; 3] = ["simd", "a second", "states in"];

/// The commands of a page, each with what it is said to print.
fn recipes(page: &str) -> Vec<(Vec<String>, Vec<String>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("book/src/tutorials/{page}.md"));
    let text = std::fs::read_to_string(&path).unwrap();
    let mut recipes = Vec::new();
    for block in text.split("```console\n").skip(1) {
        for line in block.split("```").next().unwrap().lines() {
            if let Some(command) = line.strip_prefix("$ lapswarm ") {
                recipes.push((
                    command.split_whitespace().map(str::to_owned).collect(),
                    Vec::new(),
                ));
            } else {
                recipes
                    .last_mut()
                    .expect("a command first")
                    .1
                    .push(line.to_owned());
            }
        }
    }
    assert!(!recipes.is_empty(), "{}", path.display());
    recipes
}

/// A line without its figures and without the width of its columns, and the figures.
fn split(line: &str) -> (String, Vec<f64>) {
    let (mut words, mut figures) = (Vec::new(), Vec::new());
    for word in line.split_whitespace() {
        let figure = word.trim_matches(|c: char| "()+,;:%.".contains(c));
        if let Ok(figure) = figure.parse() {
            words.push("#");
            figures.push(figure);
        } else {
            words.push(word);
        }
    }
    (words.join(" "), figures)
}

/// What percents and shares in prose are rounded by. What is smaller is not compared.
const ROUNDED: f64 = 0.005;
/// By this share figures may differ: those of swarms on machines with other instructions, and those that a new build changes without a
/// word in the book.
const SHARE: f64 = 0.002;

#[test]
#[ignore = "full tier: runs the recipes of the tutorials"]
fn recipes_of_the_tutorials_print_what_the_book_says() {
    let mut faults = Vec::new();
    for pages in TUTORIALS {
        let place = tempfile::tempdir().unwrap();
        for (command, book) in pages.iter().flat_map(|page| recipes(page)) {
            let run = Command::new(env!("CARGO_BIN_EXE_lapswarm"))
                .args(&command)
                .current_dir(place.path())
                .output()
                .unwrap();
            let said = [run.stdout, run.stderr].concat();
            // Files are told with their folder, which the book leaves out.
            let folder = format!("{}/", place.path().canonicalize().unwrap().display());
            let said = String::from_utf8(said).unwrap().replace(&folder, "");
            let command = command.join(" ");
            assert!(run.status.success(), "{command}: {said}");
            let mut printed: HashMap<String, Vec<Vec<f64>>> = HashMap::new();
            for line in said.lines().rev() {
                let (words, figures) = split(line);
                printed.entry(words).or_default().push(figures);
            }
            for line in &book {
                let (words, figures) = split(line);
                let abridged = line.starts_with("...")
                    || line.ends_with("...")
                    || !words.contains(|c: char| c != '-' && c != ' ');
                if abridged || OF_THE_MACHINE.iter().any(|part| line.contains(part)) {
                    continue;
                }
                match printed.get_mut(&words).and_then(Vec::pop) {
                    None => faults.push(format!("{command}\n  does not print: {line}")),
                    Some(found) => {
                        let same =
                            |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDED + SHARE * a.abs().max(b.abs());
                        if !figures.iter().zip(&found).all(same) {
                            faults.push(format!("{command}\n  book:  {line}\n  found: {found:?}"));
                        }
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
