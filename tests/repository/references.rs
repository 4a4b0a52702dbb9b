//! What documents and sources refer to is in the repository.

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every text file that belongs to the repository.
fn files() -> Vec<(PathBuf, String)> {
    fn gather(folder: &Path, files: &mut Vec<(PathBuf, String)>) {
        for entry in folder.read_dir().expect("a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name());
            // Builds, runs and what fuzzing left.
            let left = ["target", "runs", ".git", "corpus", "artifacts"];
            if left.iter().any(|other| name == *other) {
                continue;
            }
            if path.is_dir() {
                gather(&path, files);
                continue;
            }
            let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
            if ["", "rs", "md", "toml", "sh", "wgsl", "js", "cff", "yml"].contains(&extension)
                && let Ok(text) = std::fs::read_to_string(&path)
            {
                files.push((path, text));
            }
        }
    }
    let mut found = Vec::new();
    gather(root(), &mut found);
    assert!(found.len() > 300, "{} files", found.len());
    found
}

/// Whether a file is there, named from the repository's root, from the folder of the file that names it, or from the book's pages.
fn is_there(from: &Path, name: &str) -> bool {
    let name = name.trim_start_matches('/');
    let folder = from.parent().unwrap_or(root());
    [root(), folder, &root().join("book/src")]
        .iter()
        .any(|place| place.join(name).exists())
}

#[test]
fn documents_that_are_cited_are_there() {
    for (path, text) in files() {
        let in_a_name = |c: char| c.is_alphanumeric() || "._-/".contains(c);
        let words = text.split(|c: char| !in_a_name(c));
        for name in words.map(|word| word.trim_end_matches(['.', '/'])) {
            let cited = name.ends_with(".md") && !name.starts_with('.') && !name.contains("//");
            assert!(!cited || is_there(&path, name), "{} cites {name}", path.display());
        }
    }
}

#[test]
fn nothing_outside_is_named() {
    // Put together, so that this file does not name it.
    let outside = ["..", "shared"].join("/");
    for (path, text) in files() {
        assert!(!text.contains(&outside), "{} names {outside}", path.display());
    }
}

#[test]
fn links_lead_somewhere() {
    let mut links = 0;
    for (path, text) in files() {
        if path.extension().is_none_or(|e| e != "md") {
            continue;
        }
        // Targets stand between `](` and `)`.
        for target in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = target.split([' ', '#']).next().unwrap_or_default();
            if target.is_empty() || target.contains("://") || target.starts_with("mailto:") {
                continue;
            }
            let folder = path.parent().unwrap_or(root());
            assert!(
                folder.join(target).exists(),
                "{} links to {target}",
                path.display()
            );
            links += 1;
        }
    }
    assert!(links > 5, "{links} links");
}
