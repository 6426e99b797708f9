//! Gmsh files: format 4.1 and 2.2, ASCII and binary.
//!
//! [`read`] parses the file into a [`Raw`] list of nodes, elements and groups, then [`body`] picks the cells
//! of one body and the boundary lines that lie on it.
mod body;
mod scan;
#[cfg(test)]
mod tests;
mod v2;
mod v4;

use super::Mesh;
use crate::error::{Error, Result};
use scan::Scanner;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Reads the body that the physical groups `groups` are (none: all cells) from a Gmsh file, its coordinates times `scale`.
///
/// Physical groups of dimension 2 are bodies and parts of bodies, of dimension 1 surfaces; one without a name is called `group
/// <tag>`. Clockwise cells are turned round, and nodes that the body does not use are dropped.
pub fn read(file: &Path, groups: &[&str], scale: f64) -> Result<Mesh> {
    let name = file.display().to_string();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(Error::input(format!("{name}: scale {scale} must be a positive number")));
    }
    let bytes =
        std::fs::read(file).map_err(|e| Error::input(format!("{name}: cannot read the mesh: {e}")))?;
    body::select(&name, &parse(&name, &bytes)?, groups, scale)
}

/// What a Gmsh file says.
#[derive(Debug, Default)]
struct Raw {
    /// Names of physical groups by (dimension, tag).
    names: BTreeMap<(i32, i32), String>,
    /// Nodes by tag.
    nodes: HashMap<u64, [f64; 3]>,
    /// Lines and cells.
    elements: Vec<Element>,
}

/// An element of a Gmsh file.
#[derive(Debug)]
struct Element {
    tag: u64,
    kind: Kind,
    /// Tags of its physical groups, of its dimension.
    groups: Vec<i32>,
    nodes: Vec<u64>,
}

/// The element types kontakt reads, by their nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Point,
    Line2,
    Line3,
    Tri3,
    Tri6,
    Quad4,
    Quad8,
}

impl Kind {
    /// By Gmsh's number, or what to do about it.
    fn new(gmsh_type: i32) -> std::result::Result<Kind, String> {
        Ok(match gmsh_type {
            15 => Kind::Point,
            1 => Kind::Line2,
            8 => Kind::Line3,
            2 => Kind::Tri3,
            9 => Kind::Tri6,
            3 => Kind::Quad4,
            16 => Kind::Quad8,
            10 => {
                return Err(
                    "9-node quadrilaterals are not read; set Mesh.SecondOrderIncomplete = 1 in Gmsh to get \
                            8-node ones"
                        .into(),
                );
            }
            4..=7 | 11..=14 | 17..=19 | 29..=34 | 71..=79 | 90..=137 => {
                return Err(format!(
                    "element type {gmsh_type} is three-dimensional; mesh a surface only, with gmsh -2, or \
                     save only \
                     physical groups of dimensions 1 and 2 (Mesh.SaveAll = 0)"
                ));
            }
            _ => {
                return Err(format!(
                    "element type {gmsh_type} is not read; kontakt reads 3- and 6-node triangles and 4- \
                     and 8-node \
                     quadrilaterals: set Mesh.ElementOrder to 1 or 2 in Gmsh"
                ));
            }
        })
    }

    fn dim(self) -> i32 {
        match self {
            Kind::Point => 0,
            Kind::Line2 | Kind::Line3 => 1,
            Kind::Tri3 | Kind::Tri6 | Kind::Quad4 | Kind::Quad8 => 2,
        }
    }

    fn n_nodes(self) -> usize {
        match self {
            Kind::Point => 1,
            Kind::Line2 => 2,
            Kind::Line3 | Kind::Tri3 => 3,
            Kind::Quad4 => 4,
            Kind::Tri6 => 6,
            Kind::Quad8 => 8,
        }
    }
}

/// Parses a whole file.
fn parse(file: &str, bytes: &[u8]) -> Result<Raw> {
    let mut scan = Scanner::new(file, bytes);
    let mut raw = Raw::default();
    let version = format(&mut scan)?;
    let mut entities = HashMap::new();
    let (mut nodes, mut elements) = (false, false);
    while let Some(section) = scan.next_section()? {
        match section.as_str() {
            "PhysicalNames" => names(&mut scan, &mut raw)?,
            "Entities" if version == Version::V4 => entities = v4::entities(&mut scan)?,
            "Nodes" => {
                nodes = true;
                match version {
                    Version::V2 => v2::nodes(&mut scan, &mut raw)?,
                    Version::V4 => v4::nodes(&mut scan, &mut raw)?,
                }
            }
            "Elements" => {
                elements = true;
                match version {
                    Version::V2 => v2::elements(&mut scan, &mut raw)?,
                    Version::V4 => v4::elements(&mut scan, &mut raw, &entities)?,
                }
            }
            "ParametricNodes" => {
                return Err(scan.error(
                    "the nodes are saved with their parameters on curves, which are not read; save the mesh again with \
                     Mesh.SaveParametric = 0",
                ));
            }
            "PartitionedEntities" => {
                return Err(scan
                    .error("the mesh is partitioned; save it unpartitioned, kontakt shares it out itself"));
            }
            _ => {
                scan.skip_section()?;
                continue;
            }
        }
        scan.end_section()?;
    }
    if nodes && elements {
        return Ok(raw);
    }
    Err(scan.error(if nodes { "the section $Elements is missing" } else { "the section $Nodes is missing" }))
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Version {
    V2,
    V4,
}

/// The section `$MeshFormat`, which comes first (after comments).
fn format(scan: &mut Scanner) -> Result<Version> {
    loop {
        match scan.next_section()?.as_deref() {
            Some("MeshFormat") => break,
            Some("Comments") => scan.skip_section()?,
            _ => return Err(scan.error("this is not a Gmsh file: expected $MeshFormat")),
        }
    }
    let line = scan.line()?;
    let words: Vec<&str> = line.split_whitespace().collect();
    let [version, kind, size] = words[..] else {
        return Err(scan.error(format!("expected version, file type and data size, found {line:?}")));
    };
    let version = match version {
        "2.2" | "2.1" | "2" => Version::V2,
        "4.1" => Version::V4,
        other => {
            return Err(scan.error(format!(
                "format {other} is not read; save as 4.1 or 2.2 (gmsh -format msh41, or Mesh.MshFileVersion)"
            )));
        }
    };
    if size != "8" {
        return Err(scan.error(format!("data size {size} is not read, only 8")));
    }
    match kind {
        "0" => {}
        "1" => scan.binary()?,
        other => return Err(scan.error(format!("file type {other}: expected 0 (ASCII) or 1 (binary)"))),
    }
    scan.end_section()?;
    Ok(version)
}

/// The section `$PhysicalNames`, text in binary files too: dimension, tag, "name".
fn names(scan: &mut Scanner, raw: &mut Raw) -> Result<()> {
    let count = scan.line()?;
    let count: usize = count
        .trim()
        .parse()
        .map_err(|_| scan.error(format!("expected a number of names, found {count:?}")))?;
    for _ in 0..count {
        let line = scan.line()?;
        let wrong = || scan.error(format!("expected dimension, tag and \"name\", found {line:?}"));
        let (numbers, name) = line.split_once('"').ok_or_else(wrong)?;
        let numbers: Vec<i32> = numbers
            .split_whitespace()
            .map(str::parse)
            .collect::<std::result::Result<_, _>>()
            .map_err(|_| wrong())?;
        let [dim, tag] = numbers[..] else { return Err(wrong()) };
        let (name, _) = name.rsplit_once('"').ok_or_else(wrong)?;
        raw.names.insert((dim, tag), name.to_string());
    }
    Ok(())
}

impl Raw {
    /// Adds a node; the file must not give it twice.
    fn add_node(&mut self, scan: &Scanner, tag: u64, point: [f64; 3]) -> Result<()> {
        if let Some(x) = point.iter().find(|x| !x.is_finite()) {
            return Err(scan.error(format!("node {tag}: the coordinate {x} is not a finite number")));
        }
        match self.nodes.insert(tag, point) {
            Some(_) => Err(scan.error(format!("node {tag} is given twice"))),
            None => Ok(()),
        }
    }

    /// Name of a physical group.
    fn name(&self, dim: i32, tag: i32) -> String {
        self.names.get(&(dim, tag)).cloned().unwrap_or_else(|| format!("group {tag}"))
    }
}
