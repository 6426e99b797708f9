//! One number that stands for all a run depends on.
use std::path::Path;

use super::node::{Node, Value};
use crate::stable_hash::StableHash;

/// Tables that a run does not look at.
const IDLE: [&str; 3] = ["study", "exact", "variant"];

/// Of the changed tree, and of the content of every file it names. Comments and layout do not count.
pub(super) fn of(root: &Node, directory: &Path) -> u64 {
    let mut hash = StableHash::new();
    for (key, node) in root.entries().unwrap_or_default() {
        if !IDLE.contains(&key.as_str()) {
            hash = hash.field(key.as_bytes()).field(node.to_string().as_bytes());
            hash = files(node, directory, hash);
        }
    }
    hash.finish()
}

/// Hashes what the keys called `file` lead to; a file that cannot be read is no file, and an error elsewhere.
fn files(node: &Node, directory: &Path, hash: StableHash) -> StableHash {
    match &node.value {
        Value::Table(entries) => entries.iter().fold(hash, |hash, (key, value)| match value.text() {
            Some(name) if key == "file" => match std::fs::read(directory.join(name)) {
                Ok(content) => hash.bytes(&[1]).field(&content),
                Err(_) => hash.bytes(&[0]),
            },
            _ => files(value, directory, hash),
        }),
        Value::Array(items) => items.iter().fold(hash, |hash, item| files(item, directory, hash)),
        _ => hash,
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

    /// It is kept in files that another build of kontakt reads: FNV-1a of the keys and values with their lengths.
    #[test]
    fn it_is_the_same_in_every_build() {
        let root = Node::parse("a = 1\nb = \"x\"\n", "f.toml").unwrap();
        let bytes = b"\x01\0\0\0\0\0\0\0a\x01\0\0\0\0\0\0\x001\x01\0\0\0\0\0\0\0b\x03\0\0\0\0\0\0\0\"x\"";
        assert_eq!(of(&root, Path::new("")), StableHash::new().bytes(bytes).finish());
    }
}
