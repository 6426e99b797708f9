//! Tangential tractions of a pair with their bounds, and where it sticks and slips.
use super::chart::{BESIDE, Line};
use super::curve::Curve;
use super::legend::Symbol;
use super::{FONT, INK, failed};
use crate::contact::Law;
use crate::error::Result;
use crate::record::{IN_CONTACT, SLIPS};
use crate::vector::larger;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Height of the chart, pixels.
const CHART: i32 = 370;
/// Height of a row of what sticks and slips.
const ROW: i32 = 16;
/// Pixels above the rows.
const ABOVE: i32 = 8;
/// Half the height of the bar where it sticks.
const BAR: i32 = 4;
/// Bounds closer to each other than this share are one line.
const ALIKE: f64 = 0.01;

/// What a pair does tangentially, in the colour of the curve of its pressure.
pub(super) struct Traction<'a> {
    /// Positive along the surface.
    traction: Curve<'a>,
    /// None where the law has none, or where a later step has the same.
    bound: Option<Curve<'a>>,
    /// By node, as in the tables.
    status: Curve<'a>,
}

impl Traction<'_> {
    /// The lines of the chart.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        let bounds = self.bound.iter().flat_map(|bound| [1.0, -1.0].map(|sign| Line::broken(bound, sign)));
        bounds.chain([Line::new(&self.traction)])
    }
}

/// Of each curve of pressure on the side of the multipliers; of none without a tangential law. `varies`: the law does from node to
/// node, and the bounds are not drawn.
pub(super) fn tractions<'a>(law: Law, varies: bool, pressures: &[Curve<'a>]) -> Vec<Traction<'a>> {
    let mut all: Vec<Traction> = Vec::new();
    // From the last one on.
    for curve in pressures.iter().filter(|curve| curve.table.multipliers).rev() {
        let table = curve.table;
        let Some(tangential) = &table.tangential else { continue };
        let bound = |i: usize| match table.touches(i) {
            true => law.bound(table.pressure[i]).unwrap_or(0.0),
            false => 0.0,
        };
        let bound = law.bound(0.0).filter(|_| !varies).map(|_| curve.with_values(1, bound));
        let known =
            |bound: &Curve| all.iter().flat_map(|later| &later.bound).any(|later| alike(bound, later));
        let bound = bound.filter(|bound| !known(bound));
        all.push(Traction {
            traction: curve.with_values(curve.stroke.stroke_width, |i| tangential.traction[i]),
            bound,
            status: curve.with_values(2, |i| f64::from(table.status[i])),
        });
    }
    all.reverse();
    all
}

fn alike(a: &Curve, b: &Curve) -> bool {
    let size = a.points.iter().chain(&b.points).map(|point| point.value).fold(0.0, larger);
    a.points.len() == b.points.len()
        && std::iter::zip(&a.points, &b.points).all(|(a, b)| (a.value - b.value).abs() <= ALIKE * size)
}

/// What the lines and bars mean.
pub(super) fn symbols(law: Law, varies: bool) -> Vec<(Symbol, String)> {
    let bound = match law {
        Law::Coulomb { friction } => Some(format!("bound of the traction, \u{b1}{friction} p")),
        Law::Tresca { .. } => Some("bound of the traction".to_owned()),
        Law::Frictionless | Law::Rough | Law::Tied => None,
    };
    // What has no bound does not slip.
    let slips = bound.is_some().then(|| (Symbol::Line(INK.stroke_width(2)), "slips".to_owned()));
    let bound = bound.filter(|_| !varies).map(|name| (Symbol::Dashes(INK.stroke_width(1)), name));
    let sticks = (Symbol::Bar(INK), "sticks".to_owned());
    bound.into_iter().chain([sticks]).chain(slips).collect()
}

/// Pixels of chart and strip.
pub(super) fn height(tractions: &[Traction]) -> i32 {
    if tractions.is_empty() { 0 } else { CHART + strip_height(tractions) }
}

/// Pixels of the strip.
pub(super) fn strip_height(tractions: &[Traction]) -> i32 {
    ABOVE + ROW * tractions.len() as i32
}

/// Where it sticks and slips: a row of bars and lines for each step.
pub(super) fn strip(
    area: &DrawingArea<SVGBackend, Shift>,
    tractions: &[Traction],
    [from, to]: [f64; 2],
) -> Result<()> {
    let width = area.dim_in_pixel().0 as i32 - BESIDE[0] - BESIDE[1];
    let pixel = |s: f64| BESIDE[0] + ((s - from) / (to - from) * f64::from(width)).round() as i32;
    let style = TextStyle::from((FONT, 13).into_font()).color(&INK).pos(Pos::new(HPos::Right, VPos::Center));
    for (i, Traction { status, .. }) in tractions.iter().enumerate() {
        let y = ABOVE + ROW * i as i32 + ROW / 2;
        let name = if tractions.len() > 1 { status.name.split(',').next() } else { None };
        area.draw(&Text::new(name.unwrap_or("state"), (BESIDE[0] - 8, y), style.clone())).map_err(failed)?;
        for (what, [a, b]) in stretches(status, [from, to]) {
            // A stretch of less than a pixel is seen.
            let (a, b) = (pixel(a), pixel(b).max(pixel(a) + 1));
            match what {
                SLIPS => area.draw(&PathElement::new([(a, y), (b, y)], status.stroke)),
                _ => area.draw(&Rectangle::new([(a, y - BAR), (b, y + BAR)], status.colour.filled())),
            }
            .map_err(failed)?;
        }
    }
    Ok(())
}

/// Stretches in contact with their status: each node's reaches half the way to the next one.
fn stretches(status: &Curve, [from, to]: [f64; 2]) -> Vec<(i32, [f64; 2])> {
    let mut found: Vec<(i32, [f64; 2])> = Vec::new();
    let mut add = |value: f64, a: f64, b: f64| {
        let (what, a, b) = (value as i32, a.min(b).max(from), a.max(b).min(to));
        if what < IN_CONTACT || a >= b {
            return;
        }
        match found.last_mut() {
            // Forwards or backwards along the coordinate.
            Some((last, [_, end])) if *last == what && *end == a => *end = b,
            Some((last, [start, _])) if *last == what && *start == b => *start = a,
            _ => found.push((what, [a, b])),
        }
    };
    for ends in status.points.windows(2) {
        let [p, q] = [ends[0], ends[1]];
        match status.period {
            // Across where the coordinate begins anew.
            Some(period) if (q.s - p.s).abs() > 0.5 * period => {
                let seams = if p.s > q.s { [period, 0.0] } else { [0.0, period] };
                add(p.value, p.s, seams[0]);
                add(q.value, seams[1], q.s);
            }
            _ => {
                let middle = 0.5 * (p.s + q.s);
                add(p.value, p.s, middle);
                add(q.value, middle, q.s);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::curve::testing::{curve, table};
    use super::*;
    use crate::record::{SideTable, Tangential};

    const COULOMB: Law = Law::Coulomb { friction: 0.5 };

    #[test]
    fn bounds_are_drawn_once_and_on_both_sides() {
        let side = |pressure: [f64; 3], status: [i32; 3]| {
            let mut side = table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], status);
            side.pressure = pressure.to_vec();
            side.tangential = Some(Tangential { traction: vec![0.0, -1.0, 0.5], slip: vec![0.0; 3] });
            side
        };
        let (first, second, third) = (
            side([0.0, 2.0, 2.0], [1, 2, 2]),
            side([0.0, 4.0, 1.0], [1, 2, 3]),
            side([0.0, 4.0, 1.001], [1, 2, 3]),
        );
        let curves = [curve(&first), curve(&second), curve(&third)];
        let bounds = |law: Law| -> Vec<Option<Vec<f64>>> {
            let values = |curve: &Curve| curve.points.iter().map(|point| point.value).collect();
            tractions(law, false, &curves).iter().map(|t| t.bound.as_ref().map(values)).collect()
        };
        assert_eq!(bounds(COULOMB), [Some(vec![0.0, 1.0, 1.0]), None, Some(vec![0.0, 2.0, 0.5005])]);
        assert_eq!(bounds(Law::Tresca { shear: 3.0 }), [None, None, Some(vec![0.0, 3.0, 3.0])]);
        assert_eq!(bounds(Law::Tied), [None, None, None]);
        // That of the last one but one lies between.
        let again = [curve(&second), curve(&first), curve(&third)];
        let drawn: Vec<bool> = tractions(COULOMB, false, &again).iter().map(|t| t.bound.is_some()).collect();
        assert_eq!(drawn, [false, true, true]);
        let all = tractions(COULOMB, false, &curves);
        assert_eq!(all.iter().map(|t| t.lines().count()).collect::<Vec<_>>(), [3, 1, 3]);
        assert_eq!(all[0].traction.points[1].value, -1.0);
        // The other side's are those of this one.
        let other = SideTable { multipliers: false, ..first.clone() };
        assert!(tractions(COULOMB, false, &[curve(&other)]).is_empty());
        let smooth = SideTable { tangential: None, ..first };
        assert!(tractions(Law::Frictionless, false, &[curve(&smooth)]).is_empty());
    }

    #[test]
    fn a_node_sticks_or_slips_half_the_way_to_the_next() {
        let of = |status: [i32; 3], closed: Option<f64>, range: [f64; 2]| {
            let side = SideTable { closed, ..table([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], status) };
            stretches(&curve(&side).with_values(1, |i| f64::from(side.status[i])), range)
        };
        assert_eq!(of([1, 2, 3], None, [0.0, 2.0]), [(2, [0.5, 1.5]), (3, [1.5, 2.0])]);
        assert_eq!(of([2, 2, 3], None, [0.25, 1.75]), [(2, [0.25, 1.5]), (3, [1.5, 1.75])]);
        assert_eq!(of([2, 1, 1], Some(3.0), [0.0, 3.0]), [(2, [0.0, 0.5]), (2, [2.5, 3.0])]);
        assert!(of([0, 1, 1], None, [0.0, 2.0]).is_empty());
    }
}
