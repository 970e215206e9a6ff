//! A frame for the page: places and shapes as numbers in a row, little endian, so that drawing needs no parsing.
//!
//! ```text
//! u32 version | u32 sections | f64 tick | f64 time (s) | u32 robots N | u32 packets E
//! f32 x[N] | f32 y[N] | f32 heading[N] | u8 status[N]
//! cells        f32 centroid x[N] | f32 centroid y[N] | u8 corners[N] | u8 corners of V+[N] | for each robot f32 (x, y) of both
//! packets      u32 sender[E] | u32 receiver[E] | u8 fate[E]
//! global cells f32 disagreement[N] | u8 corners[N] | f32 (x, y)
//! errors       f32 estimated error[N]
//! ```
//!
//! Every array begins at a multiple of four bytes; what is not known is NaN.

use squad::Participation;

use crate::{
    picture::{Pictures, Place},
    swarm::Swarm,
};

/// Version of this layout.
const VERSION: u32 = 1;

/// Sections that a page wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shown {
    pub(crate) cells: bool,
    pub(crate) global: bool,
    pub(crate) edges: bool,
}

const CELLS: u32 = 1;
const EDGES: u32 = 2;
const GLOBAL: u32 = 4;
const ERRORS: u32 = 8;
/// Fate of a packet: it was handed to its receiver.
const DELIVERED: u8 = 0;

/// Bytes in a row.
struct Bytes(Vec<u8>);

impl Bytes {
    fn u32(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    fn f64(&mut self, value: f64) {
        self.0.extend(value.to_le_bytes());
    }

    fn f32s(&mut self, values: impl Iterator<Item = f64>) {
        values.for_each(|value| self.0.extend((value as f32).to_le_bytes()));
    }

    /// A column of bytes, to the next multiple of four.
    fn u8s(&mut self, values: impl Iterator<Item = u8>) {
        self.0.extend(values);
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }

    fn places<'a>(&mut self, places: impl Iterator<Item = &'a Place>) {
        places.for_each(|place| self.f32s(place.iter().copied()));
    }
}

/// The swarm as it is now.
pub(crate) fn encode(swarm: &Swarm, shown: Shown) -> Vec<u8> {
    let robots = swarm.poses.len();
    let are_computed = swarm.pictures().cells.len() == robots;
    let has_cells = shown.cells && are_computed && !swarm.percepts.is_empty();
    let has_global = shown.global && are_computed;
    let has_edges = shown.edges && !swarm.percepts.is_empty();
    let edges: Vec<(u32, u32, u8)> = match has_edges {
        true => heard(swarm).chain(swarm.losses.iter().copied()).collect(),
        false => Vec::new(),
    };
    let mut bytes = Bytes(Vec::with_capacity(64 + robots * 160 + edges.len() * 9));
    bytes.u32(VERSION);
    let section = |flag, is_there| if is_there { flag } else { 0 };
    bytes.u32(section(CELLS, has_cells) | section(EDGES, has_edges) | section(GLOBAL, has_global) | ERRORS);
    bytes.f64(swarm.tick as f64);
    bytes.f64(swarm.time_s);
    bytes.u32(robots as u32);
    bytes.u32(edges.len() as u32);
    for column in 0..3 {
        bytes.f32s(swarm.poses.iter().map(|pose| pose[column]));
    }
    bytes.u8s((0..robots).map(|robot| status(swarm.participation(robot))));
    if has_cells {
        put_cells(&mut bytes, swarm.pictures());
    }
    if has_edges {
        edges.iter().for_each(|edge| bytes.u32(edge.0));
        edges.iter().for_each(|edge| bytes.u32(edge.1));
        bytes.u8s(edges.iter().map(|edge| edge.2));
    }
    if has_global {
        let pictures = swarm.pictures();
        bytes.f32s(pictures.disagreement.iter().map(|share| share.unwrap_or(f64::NAN)));
        bytes.u8s(pictures.global.iter().map(|cell| count(cell)));
        bytes.places(pictures.global.iter().flat_map(|cell| cell.iter().take(count(cell).into())));
    }
    let error = |robot: usize| {
        let answer = swarm.answers.get(robot).and_then(Option::as_ref);
        answer.and_then(|answer| answer.command.estimated_error).map_or(f64::NAN, |error| error.length())
    };
    bytes.f32s((0..robots).map(error));
    bytes.0
}

fn put_cells(bytes: &mut Bytes, pictures: &Pictures) {
    for axis in 0..2 {
        bytes.f32s(pictures.centroids.iter().map(|place| place.map_or(f64::NAN, |place| place[axis])));
    }
    bytes.u8s(pictures.cells.iter().map(|cell| count(cell)));
    bytes.u8s(pictures.positive.iter().map(|cell| count(cell)));
    for (cell, positive) in pictures.cells.iter().zip(&pictures.positive) {
        bytes.places(cell.iter().take(count(cell).into()));
        bytes.places(positive.iter().take(count(positive).into()));
    }
}

/// Corners that are told; no cell of a swarm has more than fit.
fn count(cell: &[Place]) -> u8 {
    cell.len().min(u8::MAX.into()) as u8
}

/// From whom each robot has heard a packet in its last percept.
fn heard(swarm: &Swarm) -> impl Iterator<Item = (u32, u32, u8)> {
    (0..).zip(&swarm.percepts).flat_map(|(receiver, percept)| {
        percept.deliveries.iter().map(move |delivery| (delivery.packet.sender().index, receiver, DELIVERED))
    })
}

fn status(participation: Participation) -> u8 {
    match participation {
        Participation::Present => 0,
        Participation::Paused => 1,
        Participation::Down => 2,
        Participation::Out => 3,
        Participation::Expected => 4,
    }
}
