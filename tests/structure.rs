//! Imports run one way: no files, and no modules at the top, import each other in a circle. Tests inside the files are left
//! out, re-exports are followed to where a name comes from.
use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

type Module = Vec<String>;
type Edges = BTreeMap<Module, BTreeSet<Module>>;

/// Source files by module path, without comments and tests.
fn sources(directory: &Path, at: &[String], files: &mut BTreeMap<Module, String>) {
    for entry in std::fs::read_dir(directory).expect("the sources") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let module = if ["mod", "lib"].contains(&&name[..]) { at.to_vec() } else { [at, &[name]].concat() };
        if path.is_dir() {
            sources(&path, &module, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = std::fs::read_to_string(&path).expect("a source file");
            let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
            let lines = code.lines().map(|line| line.split("//").next().unwrap_or_default());
            files.insert(module, lines.collect::<Vec<_>>().join("\n"));
        }
    }
}

/// The paths of a use tree.
fn expand(tree: &str) -> Vec<String> {
    let Some((before, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        return vec![path.trim().to_owned()];
    };
    let inside = rest.rsplit_once('}').expect("a closing brace").0;
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in inside.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match (c, depth) {
            (',', 0) => parts.push(String::new()),
            _ => parts.last_mut().expect("a part").push(c),
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts.flat_map(|part| expand(part)).map(|path| format!("{}{path}", before.trim())).collect()
}

/// A path from the crate's root; `None` if it is another crate's.
fn absolute(path: &str, own: &[String], files: &BTreeMap<Module, String>) -> Option<Module> {
    let parts: Vec<String> = path.split("::").map(|part| part.trim().to_owned()).collect();
    let up = parts.iter().take_while(|part| *part == "super").count();
    match &parts[0][..] {
        "crate" => Some(parts[1..].to_vec()),
        "super" => Some([&own[..own.len() - up], &parts[up..]].concat()),
        "self" => Some([own, &parts[1..]].concat()),
        first => files.contains_key(&[own, &[first.to_owned()]].concat()).then(|| [own, &parts].concat()),
    }
}

/// The file that a path leads to.
fn resolve(
    path: &[String],
    files: &BTreeMap<Module, String>,
    names: &BTreeMap<Module, Module>,
) -> Option<Module> {
    let n = (0..=path.len()).rev().find(|n| files.contains_key(&path[..*n]))?;
    match path.get(n).and_then(|_| names.get(&path[..n + 1])) {
        Some(origin) if origin != path => resolve(origin, files, names),
        _ => Some(path[..n].to_vec()),
    }
}

/// What is left when all that imports nothing of the rest, or is imported by nothing of it, is taken away.
fn circles(mut edges: Edges) -> Vec<String> {
    loop {
        let targets: BTreeSet<Module> = edges.values().flatten().cloned().collect();
        let before = edges.values().map(BTreeSet::len).sum::<usize>();
        edges.retain(|module, imports| targets.contains(module) && !imports.is_empty());
        let sources: BTreeSet<Module> = edges.keys().cloned().collect();
        edges.values_mut().for_each(|imports| imports.retain(|module| sources.contains(module)));
        if edges.values().map(BTreeSet::len).sum::<usize>() == before {
            break;
        }
    }
    let show = |(module, imports): (&Module, &BTreeSet<Module>)| {
        let imports: Vec<String> = imports.iter().map(|module| module.join("/")).collect();
        format!("{} imports {}", module.join("/"), imports.join(", "))
    };
    edges.iter().map(show).collect()
}

#[test]
fn imports_run_one_way() {
    let mut files = BTreeMap::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &[], &mut files);
    let (mut names, mut imports): (BTreeMap<Module, Module>, _) = (BTreeMap::new(), Vec::new());
    for (own, code) in &files {
        for statement in code.split(';') {
            let Some(start) = statement.rfind("use ") else { continue };
            let (head, tree) = (&statement[..start], &statement[start + 4..]);
            let line = head.rsplit('\n').next().unwrap_or_default().trim();
            let public = line.starts_with("pub");
            if !public && !line.is_empty() {
                continue;
            }
            for path in expand(tree).iter().filter_map(|path| absolute(path, own, &files)) {
                if public {
                    names.insert([&own[..], &path[path.len() - 1..]].concat(), path);
                } else {
                    imports.push((own.clone(), path));
                }
            }
        }
        for (at, _) in code.match_indices("crate::") {
            let path = code[at..].split(|c: char| !c.is_alphanumeric() && c != '_' && c != ':').next();
            let path = path.unwrap_or_default().trim_end_matches(':');
            imports.extend(absolute(path, own, &files).map(|path| (own.clone(), path)));
        }
    }
    let (mut by_file, mut by_module) = (Edges::new(), Edges::new());
    for (own, path) in &imports {
        let Some(to) = resolve(path, &files, &names).filter(|to| to != own && !to.is_empty()) else {
            continue;
        };
        by_file.entry(own.clone()).or_default().insert(to.clone());
        if !own.is_empty() && own[0] != to[0] {
            by_module.entry(own[..1].to_vec()).or_default().insert(to[..1].to_vec());
        }
    }
    assert!(by_file.len() > 100 && by_module.len() > 10, "the sources were read");
    assert_eq!(circles(by_module), Vec::<String>::new(), "modules");
    assert_eq!(circles(by_file), Vec::<String>::new(), "files");
}

#[test]
fn a_circle_is_found() {
    let module = |name: &str| vec![name.to_owned()];
    let edges = |list: &[(&str, &str)]| {
        let mut edges = Edges::new();
        list.iter().for_each(|(a, b)| {
            edges.entry(module(a)).or_default().insert(module(b));
        });
        edges
    };
    assert!(circles(edges(&[("a", "b"), ("b", "c"), ("a", "c")])).is_empty());
    let found = circles(edges(&[("top", "a"), ("a", "b"), ("b", "c"), ("c", "a"), ("c", "bottom")]));
    assert_eq!(found, ["a imports b", "b imports c", "c imports a"]);
}
