//! Entities, nodes and elements of format 4.1.
use super::scan::Scanner;
use super::{Element, Kind, Raw};
use crate::error::Result;
use std::collections::HashMap;

/// Physical groups of each geometric entity, by (dimension, tag).
pub type Entities = HashMap<(i32, i32), Vec<i32>>;

/// `$Entities`: tag, box (a point: coordinates), physical groups, bounding entities (a point: none).
pub fn entities(scan: &mut Scanner) -> Result<Entities> {
    let counts = [scan.size()?, scan.size()?, scan.size()?, scan.size()?];
    let mut entities = Entities::new();
    for (dim, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = scan.int()?;
            scan.point()?;
            if dim > 0 {
                scan.point()?;
            }
            let mut groups = Vec::new();
            for _ in 0..scan.size()? {
                // A negative tag means the entity runs the other way in the group.
                groups.push(scan.int()?.wrapping_abs());
            }
            if dim > 0 {
                for _ in 0..scan.size()? {
                    scan.int()?;
                }
            }
            entities.insert((dim, tag), groups);
        }
    }
    Ok(entities)
}

/// `$Nodes`: blocks of tags, then coordinates (and parameters of the entity, if the block has them).
pub fn nodes(scan: &mut Scanner, raw: &mut Raw) -> Result<()> {
    let (blocks, total) = (scan.size()?, scan.size()?);
    scan.size()?;
    scan.size()?;
    let before = raw.nodes.len();
    for _ in 0..blocks {
        let dim = scan.int()?;
        scan.int()?;
        let parameters = if scan.int()? != 0 { dim.clamp(0, 3) } else { 0 };
        let count = scan.size()?;
        let mut tags = Vec::new();
        for _ in 0..count {
            tags.push(scan.size()?);
        }
        for tag in tags {
            let point = scan.point()?;
            for _ in 0..parameters {
                scan.real()?;
            }
            raw.add_node(scan, tag, point)?;
        }
    }
    let found = (raw.nodes.len() - before) as u64;
    if found == total { Ok(()) } else { Err(scan.error(format!("{total} nodes announced, {found} given"))) }
}

/// `$Elements`: blocks of one entity and one type, each a list of tag and nodes.
pub fn elements(scan: &mut Scanner, raw: &mut Raw, entities: &Entities) -> Result<()> {
    let (blocks, total) = (scan.size()?, scan.size()?);
    scan.size()?;
    scan.size()?;
    let before = raw.elements.len();
    for _ in 0..blocks {
        let entity = (scan.int()?, scan.int()?);
        let kind = Kind::new(scan.int()?).map_err(|message| scan.error(message))?;
        let groups = entities.get(&entity).cloned().unwrap_or_default();
        for _ in 0..scan.size()? {
            let tag = scan.size()?;
            let nodes = (0..kind.n_nodes()).map(|_| scan.size()).collect::<Result<_>>()?;
            raw.elements.push(Element { tag, kind, groups: groups.clone(), nodes });
        }
    }
    let found = (raw.elements.len() - before) as u64;
    if found == total {
        Ok(())
    } else {
        Err(scan.error(format!("{total} elements announced, {found} given")))
    }
}
