//! One number that stands for all a run depends on.
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use super::node::{Node, Value};

/// Tables that a run does not look at.
const IDLE: [&str; 3] = ["study", "exact", "variant"];

/// Of the changed tree, and of the content of every file it names. Comments and layout do not count.
pub(super) fn of(root: &Node, directory: &Path) -> u64 {
    let mut hasher = DefaultHasher::new();
    for (key, node) in root.entries().unwrap_or_default() {
        if !IDLE.contains(&key.as_str()) {
            (key, node.to_string()).hash(&mut hasher);
            files(node, directory, &mut hasher);
        }
    }
    hasher.finish()
}

/// Hashes what the keys called `file` lead to; a file that cannot be read is no file, and an error elsewhere.
fn files(node: &Node, directory: &Path, hasher: &mut DefaultHasher) {
    match &node.value {
        Value::Table(entries) => entries.iter().for_each(|(key, value)| match value.text() {
            Some(name) if key == "file" => std::fs::read(directory.join(name)).ok().hash(hasher),
            _ => files(value, directory, hasher),
        }),
        Value::Array(items) => items.iter().for_each(|item| files(item, directory, hasher)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_run_depends_on_counts_and_nothing_else() {
        let directory = tempfile::tempdir().unwrap();
        let of = |text: &str| of(&Node::parse(text, "f.toml").unwrap(), directory.path());
        let first = of("a = 1\nm = { file = \"m.toml\" }\n[study]\nrepeat = 2\n");
        assert_eq!(first, of("# a remark\n\na   = 1\nm.file = \"m.toml\"\n"));
        assert_ne!(first, of("a = 2\nm = { file = \"m.toml\" }\n"));
        std::fs::write(directory.path().join("m.toml"), "x").unwrap();
        assert_ne!(first, of("a = 1\nm = { file = \"m.toml\" }\n"));
    }
}
