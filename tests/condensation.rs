//! Condensation in two levels, rest and zone, against the factorisation of the whole matrix.

use kontakt::{
    error::Error,
    petsc::{Matrix, Rest, SchurFactor, ZoneFactor},
};
use mpi::{topology::SimpleCommunicator, traits::*};
use ranks::on_ranks;
use std::{collections::HashSet, rc::Rc};

mod common;
#[path = "common/ranks.rs"]
mod ranks;

/// Numbers in [-1, 1), the same in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// Plane strain, squares of four nodes with two displacements each; the lowest nodes are held.
struct Grid {
    nodes: [usize; 2],
    element: [[f64; 8]; 8],
}

#[derive(Default, Clone)]
struct Triples {
    rows: Vec<i32>,
    columns: Vec<i32>,
    values: Vec<f64>,
}

impl Triples {
    fn push(&mut self, i: usize, j: usize, value: f64) {
        self.rows.push(i as i32);
        self.columns.push(j as i32);
        self.values.push(value);
    }

    fn parts(&self) -> (&[i32], &[i32], &[f64]) {
        (&self.rows, &self.columns, &self.values)
    }
}

impl Grid {
    fn new(nodes: [usize; 2]) -> Grid {
        let (nu, g) = (0.3, 1.0 / 3.0_f64.sqrt());
        let c = 1.0 / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let d = [[c * (1.0 - nu), c * nu, 0.0], [c * nu, c * (1.0 - nu), 0.0], [0.0, 0.0, c * (0.5 - nu)]];
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let mut element = [[0.0; 8]; 8];
        for at in corners {
            let mut b = [[0.0; 8]; 3];
            for (a, corner) in corners.iter().enumerate() {
                let dx = corner[0] * (1.0 + corner[1] * at[1] * g) / 2.0;
                let dy = corner[1] * (1.0 + corner[0] * at[0] * g) / 2.0;
                (b[0][2 * a], b[1][2 * a + 1], b[2][2 * a], b[2][2 * a + 1]) = (dx, dy, dy, dx);
            }
            for (i, row) in element.iter_mut().enumerate() {
                for (j, value) in row.iter_mut().enumerate() {
                    for k in 0..3 {
                        for l in 0..3 {
                            *value += b[k][i] * d[k][l] * b[l][j] / 4.0;
                        }
                    }
                }
            }
        }
        Grid { nodes, element }
    }

    fn n(&self) -> usize {
        2 * self.nodes[0] * self.nodes[1]
    }

    fn cells(&self) -> Vec<[usize; 2]> {
        let [m, l] = self.nodes;
        (0..l - 1).flat_map(|y| (0..m - 1).map(move |x| [x, y])).collect()
    }

    fn dofs(&self, [x, y]: [usize; 2]) -> [usize; 8] {
        let node = |x: usize, y: usize| 2 * (y * self.nodes[0] + x);
        let [a, b, c, d] = [node(x, y), node(x + 1, y), node(x + 1, y + 1), node(x, y + 1)];
        [a, a + 1, b, b + 1, c, c + 1, d, d + 1]
    }

    fn is_held(&self, dof: usize) -> bool {
        dof < 2 * self.nodes[0]
    }

    /// Entries of the chosen cells, of the given stiffness each; all of the matrix or its upper triangle.
    fn triples(&self, cells: &[[usize; 2]], stiffness: &[f64], upper: bool) -> Triples {
        let mut triples = Triples::default();
        for (&cell, e) in cells.iter().zip(stiffness) {
            let dofs = self.dofs(cell);
            for (i, &row) in dofs.iter().enumerate() {
                for (j, &column) in dofs.iter().enumerate() {
                    if !self.is_held(row) && !self.is_held(column) && (!upper || row <= column) {
                        triples.push(row, column, e * self.element[i][j]);
                    }
                }
            }
        }
        triples
    }
}

/// A grid in two parts.
struct Case {
    grid: Grid,
    interface: Vec<i32>,
    rest: Vec<[usize; 2]>,
    zone: Vec<[usize; 2]>,
    in_zone: Vec<bool>,
    /// Of the rest's cells.
    stiffness: Vec<f64>,
    rest_triples: Triples,
}

impl Case {
    fn new(grid: Grid, interface: Vec<i32>, is_zone: impl Fn(&[usize; 2]) -> bool, upper: bool) -> Case {
        let (zone, rest): (Vec<_>, Vec<_>) = grid.cells().into_iter().partition(is_zone);
        let mut in_zone = vec![false; grid.n()];
        zone.iter().flat_map(|&cell| grid.dofs(cell)).for_each(|dof| in_zone[dof] = true);
        let stiffness: Vec<f64> = (0..rest.len()).map(|i| 1.0 + 0.1 * (i % 7) as f64).collect();
        let mut rest_triples = grid.triples(&rest, &stiffness, upper);
        (0..grid.n())
            .filter(|&dof| grid.is_held(dof) && !in_zone[dof])
            .for_each(|d| rest_triples.push(d, d, 1.0));
        Case { grid, interface, rest, zone, in_zone, stiffness, rest_triples }
    }

    fn rest(&self, group: &SimpleCommunicator) -> Result<Rest, Error> {
        let triples = self.rest_triples.parts();
        Rest::new(group, self.grid.n(), triples, &self.interface, &self.in_zone, "")
    }

    /// The zone's cells and the rows of its held unknowns.
    fn zone_triples(&self, stiffness: &[f64], upper: bool) -> Triples {
        let mut triples = self.grid.triples(&self.zone, stiffness, upper);
        let held = (0..self.grid.n()).filter(|&dof| self.grid.is_held(dof) && self.in_zone[dof]);
        held.for_each(|dof| triples.push(dof, dof, 1.0));
        triples
    }

    fn matrix(&self, group: &SimpleCommunicator, zone_stiffness: &[f64]) -> Matrix {
        let mut all = self.grid.triples(&self.rest, &self.stiffness, false);
        let zone = self.grid.triples(&self.zone, zone_stiffness, false);
        all.rows.extend(zone.rows);
        all.columns.extend(zone.columns);
        all.values.extend(zone.values);
        (0..self.grid.n()).filter(|&dof| self.grid.is_held(dof)).for_each(|dof| all.push(dof, dof, 1.0));
        Matrix::from_triples(group, self.grid.n(), 2, (all.rows, all.columns), all.values).unwrap()
    }
}

fn assert_close(a: &[f64], b: &[f64], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}");
    let size = b.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() <= 1e-12 * size, "{what}, entry {i}: {a} instead of {b}, largest {size}");
    }
}

fn lower(s: &[f64]) -> Vec<f64> {
    let n = s.len().isqrt();
    (0..n).flat_map(|i| s[i * n..=i * n + i].to_vec()).collect()
}

fn chosen(all: &[f64], places: &[usize]) -> Vec<f64> {
    places.iter().map(|&i| all[i]).collect()
}

/// Both ways, for zone matrices that change and right-hand sides in changing order.
fn agrees(group: &SimpleCommunicator, name: &str, case: &Case, upper: bool) {
    let mut random = Random(7);
    let n = case.grid.n();
    let rest = Rc::new(case.rest(group).unwrap());
    let mut again = None;
    let mut stiffness = vec![1.0; case.zone.len()];
    let first = case.zone_triples(&stiffness, upper);
    let (mut zone, mut s) = ZoneFactor::new(group, rest.clone(), first.parts()).unwrap();
    // Right-hand sides: any, the same but for the zone, none in the rest, nothing.
    let any = random.vector(n);
    let mut sides = [any.clone(), any.clone(), random.vector(n), vec![0.0; n]];
    let inside = |dof: &usize| !rest.zone_unknowns().contains(dof);
    (0..n).filter(|dof| !inside(dof)).for_each(|dof| sides[1][dof] += random.next());
    (0..n).filter(inside).for_each(|dof| sides[2][dof] = 0.0);
    for round in 0..3 {
        let a = case.matrix(group, &stiffness);
        let (whole, expected) = SchurFactor::new(group, &a, &case.interface, "").unwrap();
        assert_close(&lower(&s), &lower(&expected), &format!("{name}, round {round}: S"));
        let renewed = match &mut again {
            None => {
                let (factor, s) = SchurFactor::renewable(group, &a, &case.interface, "").unwrap();
                again = Some(factor);
                s
            }
            Some(factor) => factor.refactorise(group, &a).unwrap(),
        };
        assert_close(&lower(&renewed), &lower(&expected), &format!("{name}, round {round}: S renewed"));
        let again = again.as_ref().unwrap();
        for step in 0..12 {
            let what = format!("{name}, round {round}, step {step}");
            let b = &sides[((random.next() + 1.0) * 2.0) as usize];
            let x_b = random.vector(case.interface.len());
            let (reduced, x) = (whole.reduce(group, b).unwrap(), whole.expand(group, b, &x_b).unwrap());
            if step % 4 != 1 {
                assert_close(&zone.reduce(group, b).unwrap(), &reduced, &format!("{what}: reduced"));
                assert_close(
                    &again.reduce(group, b).unwrap(),
                    &reduced,
                    &format!("{what}: renewed, reduced"),
                );
            }
            for _ in 0..step % 3 {
                let of_zone = zone.expand_zone(group, b, &x_b).unwrap();
                assert_close(&of_zone, &chosen(&x, rest.zone_unknowns()), &format!("{what}: zone"));
            }
            assert_close(&zone.expand(group, b, &x_b).unwrap(), &x, &format!("{what}: expanded"));
            assert_close(&again.expand(group, b, &x_b).unwrap(), &x, &format!("{what}: renewed, expanded"));
        }
        stiffness.iter_mut().for_each(|e| *e = 1.0 + 0.8 * random.next());
        s = zone.refactorise(group, &case.zone_triples(&stiffness, upper).values).unwrap();
    }
}

fn top(grid: &Grid, from: usize, to: usize) -> Vec<i32> {
    let first = (grid.nodes[1] - 1) * grid.nodes[0];
    (from..to).flat_map(|x| [2 * (first + x), 2 * (first + x) + 1]).map(|dof| dof as i32).collect()
}

/// Tells the cells of a zone.
type IsZone<'z> = &'z dyn Fn(&[usize; 2]) -> bool;

fn all_zones_agree(group: &SimpleCommunicator) {
    let nodes = [11, 8];
    let mut random = Random(3);
    let scattered: HashSet<[usize; 2]> =
        Grid::new(nodes).cells().into_iter().filter(|_| random.next() > 0.4).collect();
    let zones: [(&str, IsZone); 9] = [
        ("nothing", &|_| false),
        ("everything", &|_| true),
        ("under the interface", &|c| (2..8).contains(&c[0]) && c[1] > 3),
        ("wider than the interface", &|c| c[1] > 4),
        ("below the interface", &|c| (3..6).contains(&c[0]) && (2..4).contains(&c[1])),
        ("a held corner", &|c| c[0] < 2 && c[1] < 2),
        ("all but one cell", &|c| *c != [4, 4]),
        ("all but a row of cells", &|c| c[1] != 3),
        ("scattered", &|c| scattered.contains(c)),
    ];
    for (name, is_zone) in zones {
        let mut backwards = top(&Grid::new(nodes), 3, 7);
        backwards.reverse();
        let everything: Vec<i32> = (0..Grid::new(nodes).n() as i32).collect();
        let interfaces =
            [top(&Grid::new(nodes), 3, 7), backwards, top(&Grid::new(nodes), 0, 11), Vec::new(), everything];
        for (i, interface) in interfaces.into_iter().enumerate() {
            for upper in [true, false] {
                let case = Case::new(Grid::new(nodes), interface.clone(), is_zone, upper);
                agrees(group, &format!("{name}, interface {i}, upper {upper}"), &case, upper);
            }
        }
    }
}

fn what_is_indefinite_is_an_error(group: &SimpleCommunicator) {
    let grid = Grid::new([11, 8]);
    let interface = top(&grid, 3, 7);
    let case = Case::new(grid, interface, |c| (2..8).contains(&c[0]) && c[1] > 3, true);
    let rest = Rc::new(case.rest(group).unwrap());
    let triples = |e: f64| case.zone_triples(&vec![e; case.zone.len()], true);
    let indefinite = |e: Error| matches!(e, Error::Indefinite(_));
    for bad in [-1.0, 0.0] {
        let error = ZoneFactor::new(group, rest.clone(), triples(bad).parts()).err().unwrap();
        assert!(indefinite(error.clone()), "{bad}: {error:?}");
        let (mut zone, s) = ZoneFactor::new(group, rest.clone(), triples(1.0).parts()).unwrap();
        let error = zone.refactorise(group, &triples(bad).values).err().unwrap();
        assert!(indefinite(error.clone()), "{bad}: {error:?}");
        assert_close(&zone.refactorise(group, &triples(1.0).values).unwrap(), &s, "after an error");
    }
    let mut bad = Case::new(Grid::new([11, 8]), case.interface.clone(), |c| c[1] > 4, true);
    bad.rest_triples.values.iter_mut().for_each(|v| *v *= -1.0);
    assert!(indefinite(bad.rest(group).err().unwrap()));
    // What is not a number passes through: the caller sees it in S.
    let (mut zone, _) = ZoneFactor::new(group, rest.clone(), triples(1.0).parts()).unwrap();
    let not_finite = zone.refactorise(group, &triples(f64::NAN).values);
    println!("NaN: {:?}", not_finite.as_ref().map(|s| s[0]));
    assert!(not_finite.map_or(true, |s| s.iter().any(|v| v.is_nan())));
}

/// A matrix on several ranks is factorised again as it would be anew.
fn renewed_is_new(group: &SimpleCommunicator) {
    let grid = Grid::new([11, 8]);
    let (n, rank, size) = (grid.n(), group.rank() as usize, group.size() as usize);
    let n_owned = n / size + if rank == 0 { n % size } else { 0 };
    // The first rank owns the interface.
    let interface: Vec<i32> = if rank == 0 { (44..60).collect() } else { Vec::new() };
    let matrix = |e: f64| {
        let cells = grid.cells();
        let stiffness: Vec<f64> = (0..cells.len()).map(|i| 1.0 + e * (i % 5) as f64).collect();
        let mut all = grid.triples(&cells, &stiffness, false);
        (0..n).filter(|&dof| grid.is_held(dof)).for_each(|dof| all.push(dof, dof, 1.0));
        if rank > 0 {
            all = Triples::default();
        }
        Matrix::from_triples(group, n_owned, 2, (all.rows, all.columns), all.values).unwrap()
    };
    let (mut again, _) = SchurFactor::renewable(group, &matrix(0.0), &interface, "").unwrap();
    for e in [0.3, -0.1, 0.0] {
        let a = matrix(e);
        let s = again.refactorise(group, &a).unwrap();
        let (new, expected) = SchurFactor::new(group, &a, &interface, "").unwrap();
        let mut random = Random(rank as u64);
        let (b, x_b) = (random.vector(n_owned), random.vector(interface.len()));
        assert_close(&lower(&s), &lower(&expected), "S");
        let [reduced, expected] = [&again, &new].map(|f| f.reduce(group, &b).unwrap());
        assert_close(&reduced, &expected, "reduced");
        let [x, expected] = [&again, &new].map(|f| f.expand(group, &b, &x_b).unwrap());
        assert_close(&x, &expected, "expanded");
    }
    assert!(matches!(again.refactorise(group, &matrix(-1.0)), Err(Error::Indefinite(_))));
    let (mut once, _) = SchurFactor::new(group, &matrix(0.0), &interface, "").unwrap();
    assert!(once.refactorise(group, &matrix(0.0)).is_err());
}

#[test]
fn zones_agree_with_the_whole() {
    on_ranks("zones_agree_with_the_whole", &[1], all_zones_agree);
}

#[test]
fn indefinite_zones_are_errors() {
    on_ranks("indefinite_zones_are_errors", &[1], what_is_indefinite_is_an_error);
}

#[test]
fn a_factor_is_renewed() {
    on_ranks("a_factor_is_renewed", &[1, 2, 3], renewed_is_new);
}
