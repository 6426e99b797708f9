//! Nodes and elements of format 2.2.
use super::scan::Scanner;
use super::{Element, Kind, Raw};
use crate::error::Result;

/// The count that starts a section: a line of text in binary files too.
fn total(scan: &mut Scanner) -> Result<u64> {
    let line = scan.line()?;
    line.trim().parse().map_err(|_| scan.error(format!("expected a count, found {line:?}")))
}

/// `$Nodes`: tag x y z.
pub fn nodes(scan: &mut Scanner, raw: &mut Raw) -> Result<()> {
    for _ in 0..total(scan)? {
        let tag = scan.count()?;
        let point = scan.point()?;
        raw.add_node(scan, tag, point)?;
    }
    Ok(())
}

/// `$Elements`: tag, type, number of tags, tags, nodes; in binary files type and number of tags are shared by
/// a run.
pub fn elements(scan: &mut Scanner, raw: &mut Raw) -> Result<()> {
    let mut left = total(scan)?;
    while left > 0 {
        if scan.is_binary() {
            let gmsh_type = scan.int()?;
            let (run, n_tags) = (scan.count()?, scan.count()?);
            if run == 0 || run > left {
                return Err(scan.error(format!("a run of {run} elements, where {left} are left")));
            }
            for _ in 0..run {
                let tag = scan.count()?;
                element(scan, raw, tag, gmsh_type, n_tags)?;
            }
            left -= run;
        } else {
            let tag = scan.count()?;
            let gmsh_type = scan.int()?;
            let n_tags = scan.count()?;
            element(scan, raw, tag, gmsh_type, n_tags)?;
            left -= 1;
        }
    }
    Ok(())
}

/// Tags (the first is the physical group, 0 for none) and nodes of an element.
fn element(scan: &mut Scanner, raw: &mut Raw, tag: u64, gmsh_type: i32, n_tags: u64) -> Result<()> {
    let kind = Kind::new(gmsh_type).map_err(|message| scan.error(format!("element {tag}: {message}")))?;
    let mut groups = Vec::new();
    for i in 0..n_tags {
        let value = scan.int()?;
        if i == 0 && value != 0 {
            groups.push(value);
        }
    }
    let nodes = (0..kind.n_nodes()).map(|_| scan.count()).collect::<Result<_>>()?;
    raw.elements.push(Element { tag, kind, groups, nodes });
    Ok(())
}
