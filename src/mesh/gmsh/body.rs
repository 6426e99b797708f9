//! From what a Gmsh file says to the mesh of one body.
use super::{Element, Kind, Raw};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::{Cell, Facet, Mesh};
use crate::vector::{larger, largest, smaller};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

/// Sides of the chosen cells by their end nodes (mesh numbers, smaller first).
type Sides = HashMap<(u32, u32), Vec<Facet>>;

/// The mesh of the body that these groups are, or of all cells.
pub fn select(file: &str, raw: &Raw, groups: &[&str], scale: f64) -> Result<Mesh> {
    let mut body =
        Builder { file, raw, scale, mesh: Mesh { dim: 2, ..Mesh::default() }, number: HashMap::new() };
    body.cells(groups)?;
    body.mesh.points.iter_mut().for_each(|p| p[2] = 0.0);
    body.surfaces()?;
    Ok(body.mesh)
}

struct Builder<'a> {
    file: &'a str,
    raw: &'a Raw,
    scale: f64,
    mesh: Mesh,
    /// Mesh node of a file's node.
    number: HashMap<u64, u32>,
}

impl Builder<'_> {
    fn error(&self, message: impl std::fmt::Display) -> Error {
        Error::input(format!("{}: {message}", self.file))
    }

    fn cells(&mut self, groups: &[&str]) -> Result<()> {
        let all: Vec<&Element> = self.raw.elements.iter().filter(|e| e.kind.dim() == 2).collect();
        if all.is_empty() {
            return Err(self.error(
                "no triangles or quadrilaterals; if physical groups are defined, Gmsh saves only what is \
                 in one",
            ));
        }
        let tags = self.tags(groups, &all)?;
        let chosen = |e: &&&Element| groups.is_empty() || e.groups.iter().any(|tag| tags.contains(tag));
        let chosen: Vec<&Element> = all.iter().filter(chosen).copied().collect();
        self.refuse_other_planes(&chosen)?;
        let mut seen: HashMap<Vec<u64>, (u32, &Element)> = HashMap::new();
        for element in chosen {
            let number = self.mesh.cells.len() as u32;
            if let Some((cell, other)) = seen.insert(key(element), (number, element)) {
                // Format 2.2 repeats an element for each of its groups.
                if element.groups != other.groups {
                    seen.insert(key(element), (cell, element));
                    continue;
                }
                let tags = (other.tag, element.tag);
                return Err(self.error(format!("elements {} and {} have the same nodes", tags.0, tags.1)));
            }
            let cell = self.cell(element)?;
            self.mesh.cells.push(cell);
        }
        self.groups(&all, |element| seen.get(&key(element)).map(|(cell, _)| *cell));
        Ok(())
    }

    /// Tags of the physical groups that the body is.
    fn tags(&self, groups: &[&str], cells: &[&Element]) -> Result<BTreeSet<i32>> {
        let all: BTreeSet<i32> = cells.iter().flat_map(|cell| &cell.groups).copied().collect();
        let mut tags = BTreeSet::new();
        for name in groups {
            let own: BTreeSet<i32> =
                all.iter().copied().filter(|&tag| self.raw.name(2, tag) == *name).collect();
            if own.is_empty() {
                return Err(self.unknown_group(name, cells));
            }
            self.refuse_second_group(2, name, &own)?;
            tags.extend(own);
        }
        Ok(tags)
    }

    /// Which cells of the body each physical group has.
    fn groups(&mut self, cells: &[&Element], number: impl Fn(&Element) -> Option<u32>) {
        let mut groups: BTreeMap<i32, BTreeSet<u32>> = BTreeMap::new();
        for element in cells.iter().filter(|e| !e.groups.is_empty()) {
            // Most elements of other bodies are told by a node.
            let here = element.nodes.iter().all(|tag| self.number.contains_key(tag));
            if let Some(cell) = here.then(|| number(element)).flatten() {
                element.groups.iter().for_each(|&tag| groups.entry(tag).or_default().extend([cell]));
            }
        }
        for (tag, cells) in groups {
            self.mesh.groups.entry(self.raw.name(2, tag)).or_default().extend(cells);
        }
        for cells in self.mesh.groups.values_mut() {
            cells.sort_unstable();
            cells.dedup();
        }
    }

    /// On one body a name must mean one group: two would be taken together.
    fn refuse_second_group(&self, dim: i32, name: &str, tags: &BTreeSet<i32>) -> Result<()> {
        let tags: Vec<String> = tags.iter().map(i32::to_string).collect();
        match tags.len() {
            0 | 1 => Ok(()),
            _ => Err(self.error(format!(
                "the physical groups {} of dimension {dim} are all called {name:?}; give each a name of its own, or put \
                 all into one group",
                tags.join(" and ")
            ))),
        }
    }

    /// Refuses cells that do not lie in the plane z = 0, before they seem to have no area there.
    fn refuse_other_planes(&self, cells: &[&Element]) -> Result<()> {
        let tags = cells.iter().flat_map(|cell| &cell.nodes);
        let points = || tags.clone().filter_map(|tag| self.raw.nodes.get(tag));
        let range = |d: usize| {
            points()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], p| [smaller(lo, p[d]), larger(hi, p[d])])
        };
        if points().next().is_none() {
            return Ok(());
        }
        let ranges = [0, 1, 2].map(range);
        let size = largest(points().flatten());
        // Coordinates are written with at least ten digits.
        let same = |d: usize| ranges[d][1] - ranges[d][0] <= 1e-9 * size;
        let at = |d: usize| ranges[d][0];
        if ranges[2].iter().all(|z| z.abs() <= 1e-9 * size) {
            return Ok(());
        }
        let (others, thin) = (["y-z", "x-z", "x-y"], ["x", "y", "z"]);
        Err(self.error(match [2, 1, 0].into_iter().find(|&d| same(d)) {
            Some(2) => format!("the mesh lies in the plane z = {}; it must lie in the plane z = 0: move it", at(2)),
            Some(d) => format!(
                "the mesh lies in the {} plane ({} = {} everywhere); it must lie in the x-y plane, z = 0: turn it",
                others[d], thin[d], at(d)
            ),
            None => {
                let p = points().find(|p| p[2].abs() > 1e-9 * size).copied().unwrap_or_default();
                format!(
                    "the mesh must lie in the plane z = 0, but there is a node at ({}, {}, {})",
                    p[0], p[1], p[2]
                )
            }
        }))
    }

    fn unknown_group(&self, name: &str, cells: &[&Element]) -> Error {
        let names: BTreeSet<String> =
            cells.iter().flat_map(|e| e.groups.iter().map(|&tag| self.raw.name(2, tag))).collect();
        if names.is_empty() {
            return self.error(format!("no body {name:?}: the file has no physical group of dimension 2"));
        }
        let near = names.iter().find(|n| strsim::jaro_winkler(n, name) > 0.8);
        let hint = near.map_or(String::new(), |n| format!("; did you mean {n:?}?"));
        let list: Vec<String> = names.iter().map(|n| format!("{n:?}")).collect();
        self.error(format!(
            "no physical group of dimension 2 is named {name:?}; there are {}{hint}",
            list.join(", ")
        ))
    }

    /// A cell, counter-clockwise.
    fn cell(&mut self, element: &Element) -> Result<Cell> {
        let (kind, reversed): (ElementKind, &[usize]) = match element.kind {
            Kind::Tri3 => (ElementKind::Tri3, &[0, 2, 1]),
            Kind::Tri6 => (ElementKind::Tri6, &[0, 2, 1, 5, 4, 3]),
            Kind::Quad4 => (ElementKind::Quad4, &[0, 3, 2, 1]),
            Kind::Quad8 => (ElementKind::Quad8, &[0, 3, 2, 1, 7, 6, 5, 4]),
            Kind::Point | Kind::Line2 | Kind::Line3 => {
                return Err(Error::internal("a line taken for a cell"));
            }
        };
        let nodes = element.nodes.iter().map(|&n| self.node(element, n)).collect::<Result<Vec<u32>>>()?;
        let n = kind.n_corners();
        let points: Vec<[f64; 3]> = nodes.iter().map(|&i| self.mesh.points[i as usize]).collect();
        let place = format!("near ({}, {})", points[0][0], points[0][1]);
        if nodes.iter().collect::<HashSet<_>>().len() < nodes.len() {
            return Err(self.error(format!("element {} {place} has a node twice", element.tag)));
        }
        // Twice the area of the triangle at each corner: all of one sign in a convex cell.
        let size = (1..n).map(|i| distance(&points[0], &points[i])).fold(0.0, larger);
        let turns: Vec<f64> = (0..n)
            .map(|i| {
                let (a, b, c) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
                (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
            })
            .collect();
        let tiny = 1e-12 * size * size;
        if turns.iter().all(|&t| t > tiny) {
            return Ok(Cell::new(kind, &nodes));
        }
        if turns.iter().all(|&t| t < -tiny) {
            return Ok(Cell::new(kind, &reversed.iter().map(|&i| nodes[i]).collect::<Vec<_>>()));
        }
        let what = if turns.iter().all(|&t| t.abs() <= tiny) {
            "has no area"
        } else {
            "is tangled: it has a corner of 180 degrees or more"
        };
        Err(self.error(format!(
            "element {} {place} {what}; mesh again, finer or with another algorithm",
            element.tag
        )))
    }

    /// The mesh node of a file's node.
    fn node(&mut self, element: &Element, tag: u64) -> Result<u32> {
        if let Some(&number) = self.number.get(&tag) {
            return Ok(number);
        }
        let Some(point) = self.raw.nodes.get(&tag) else {
            return Err(
                self.error(format!("element {} refers to node {tag}, which is not in $Nodes", element.tag))
            );
        };
        let number = u32::try_from(self.mesh.points.len()).map_err(|_| self.error("more than 2^32 nodes"))?;
        let point = point.map(|x| x * self.scale);
        if point.iter().any(|x| x.abs() > 1e150) {
            return Err(self.error(format!("node {tag}: coordinates {point:?} are too large")));
        }
        self.mesh.points.push(point);
        self.number.insert(tag, number);
        Ok(number)
    }

    /// Surfaces: the lines of physical groups that are sides of the body's cells.
    fn surfaces(&mut self) -> Result<()> {
        let mut sides = Sides::new();
        for (ends, facet) in self.mesh.sides() {
            sides.entry(ends).or_default().push(facet);
        }
        if let Some(list) = sides.values().find(|list| list.len() > 2) {
            return Err(self.shared_side(list[0]));
        }
        let mut surfaces: BTreeMap<String, BTreeSet<(u32, u8)>> = BTreeMap::new();
        let mut tags: BTreeMap<String, BTreeSet<i32>> = BTreeMap::new();
        for line in self.raw.elements.iter().filter(|e| e.kind.dim() == 1) {
            for &tag in &line.groups {
                let name = self.raw.name(1, tag);
                if let Some(facet) = self.facet(&sides, line, &name)? {
                    tags.entry(name.clone()).or_default().insert(tag);
                    surfaces.entry(name).or_default().insert((facet.cell, facet.side));
                }
            }
        }
        tags.iter().try_for_each(|(name, tags)| self.refuse_second_group(1, name, tags))?;
        self.mesh.surfaces = surfaces
            .into_iter()
            .map(|(name, set)| (name, set.into_iter().map(|(cell, side)| Facet { cell, side }).collect()))
            .collect();
        Ok(())
    }

    fn shared_side(&self, facet: Facet) -> Error {
        let p = self.mesh.points[self.mesh.cells[facet.cell as usize].nodes()[facet.side as usize] as usize];
        self.error(format!(
            "more than two cells share a side at ({}, {}); are bodies meshed on top of each other?",
            p[0], p[1]
        ))
    }

    /// The side of the body that a line is; `None` if it belongs to another body.
    fn facet(&self, sides: &Sides, line: &Element, surface: &str) -> Result<Option<Facet>> {
        let ends = [line.nodes[0], line.nodes[1]].map(|tag| self.number.get(&tag).copied());
        let [Some(a), Some(b)] = ends else { return Ok(None) };
        let Some(found) = sides.get(&(a.min(b), a.max(b))) else { return Ok(None) };
        let p = self.mesh.points[a as usize];
        let place = format!("surface {surface:?}: line {} at ({}, {})", line.tag, p[0], p[1]);
        if found.len() == 2 {
            return Err(
                self.error(format!("{place} lies inside the body; a surface must be on its boundary"))
            );
        }
        let middle = self.mesh.facet_nodes(found[0]).nth(2);
        let own = line.nodes.get(2).map(|tag| self.number.get(tag).copied());
        if own.is_some_and(|own| own != middle) || (own.is_none() && middle.is_some()) {
            return Err(self.error(format!(
                "{place} does not have the nodes of the cell's side; mesh lines and surfaces with the \
                 same order"
            )));
        }
        Ok(Some(found[0]))
    }
}

/// What elements with the same nodes have in common.
fn key(element: &Element) -> Vec<u64> {
    let mut key = element.nodes.clone();
    key.sort_unstable();
    key
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}
