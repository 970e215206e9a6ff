//! Bodies in contact: discs and walls that push each other out of the way.
//!
//! Bodies move as they would alone, less what contacts take from it: of all displacements that leave no two bodies
//! overlapping, the nearest to the wanted ones (Σ|Δ − d|² is least). Two bodies that meet so share the way apart
//! equally, a row that is pushed moves as one, and no body stands still that has a way to go. Walls, and bodies that do
//! not yield (killed, paused, stuck), take no share. This is the discrete contact model of Maury and Venel ("A discrete
//! contact model for crowd motion", 2011); for short steps it tends to Moreau's sweeping process.
//!
//! In one step the constraints are linear: n·(Δb − Δa) ≥ bound with a unit vector n, one for each contact. Their
//! multipliers λ ≥ 0 tell by how far each contact parts its bodies. Projected Gauss-Seidel sweeps find them, which
//! conjugate gradients make fast (Silcowitz, Niebe and Erleben, "A nonsmooth nonlinear conjugate gradient method for
//! interactive contact force problems", 2010), beginning with those of the step before. A tick is cut into steps that
//! are short against a body. Each takes the directions of its contacts halfway, so that bodies that slide around each
//! other do so to second order in the step. It ends early where bodies first touch: whatever they do then, they do from
//! there on. Across a touch the nearest displacements are not those that bodies make one after the other, and where
//! bodies end would be known to first order only.

use nalgebra::Vector2;

use crate::{frame::ArenaPoint, grid::Grid};

/// Bodies may overlap by this share of their diameter: rounding, not room.
const TOUCH: f64 = 1e-9;
/// A solution is found when a sweep moves no body by more than this share of a diameter.
const CONVERGED: f64 = 1e-10;
/// The same where only the directions of contacts are looked for.
const ROUGH: f64 = 1e-6;
/// Longest step, as a share of a diameter.
const STEP: f64 = 0.0025;
/// Most steps of a tick. Bodies that move farther still do not pass through each other.
const STEPS_MAX: usize = 256;
/// Most pieces that touches cut a step into.
const PIECES_MAX: usize = 12;
/// Shortest of these but the last, as a share of the step.
const PIECE_MIN: f64 = 0.01;
/// Bodies that are apart by less than this share of a diameter touch.
const NEAR: f64 = 1e-6;
/// Most sweeps of one solution; bodies that still overlap then stay where they were.
const SWEEPS_MAX: u32 = 2000;
/// Most pairs that are looked at and contacts that sweeps correct for an island in a tick (a fifth of a second or so),
/// before the rest of the tick is taken in [`HASTY_STEPS`]: bodies that are jammed need most of [`SWEEPS_MAX`] in each
/// step, and where steps are long everybody may meet everybody.
const CORRECTIONS_MAX: u64 = 20_000_000;
/// After so many no more is looked for: what is found by then is kept if nobody overlaps.
const CORRECTIONS_END: u64 = 4 * CORRECTIONS_MAX;
/// Most steps that are left after [`CORRECTIONS_MAX`]. They are not cut where bodies first touch.
const HASTY_STEPS: usize = 4;

/// The contacts of discs of one radius in a rectangle, with what is remembered of them.
#[derive(Clone, Debug)]
pub(crate) struct Contacts {
    radius_m: f64,
    size_m: [f64; 2],
    /// Bodies that stayed where they were because no solution was found for them, tick by tick.
    unsolved: u64,
    /// Ticks of islands in which steps were longer than they should be, because there were too many.
    coarse: u64,
    grid: Grid,
    /// Pairs that may meet in a tick, lower index first.
    pairs: Vec<(usize, usize)>,
    /// Which island each body belongs to, by the index of one of its bodies.
    islands: Vec<usize>,
    /// (island, body), in order; only islands in which bodies meet.
    members: Vec<(usize, usize)>,
    /// (island, pair), in order.
    meetings: Vec<(usize, (usize, usize))>,
    /// Where bodies were before the tick.
    before: Vec<ArenaPoint>,
    /// Where the bodies of an island were before the step.
    back: Vec<ArenaPoint>,
    solver: Solver,
    /// Multipliers of the last step of the last tick, ordered by their contacts.
    memory: Vec<(Key, f64)>,
    /// The same of this tick.
    news: Vec<(Key, f64)>,
}

/// A contact by its bodies, or by a body and a wall, whose numbers follow on those of bodies.
type Key = (usize, usize);

/// Motion that bodies would make if they were alone.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    /// Displacement of each, meters.
    pub(crate) displacements: &'a [Vector2<f64>],
    /// Whether it can be pushed.
    pub(crate) yields: &'a [bool],
}

impl Contacts {
    /// No contacts yet.
    pub(crate) fn new(radius_m: f64, size_m: [f64; 2]) -> Self {
        Self {
            radius_m,
            size_m,
            unsolved: 0,
            coarse: 0,
            grid: Grid::default(),
            pairs: Vec::new(),
            islands: Vec::new(),
            members: Vec::new(),
            meetings: Vec::new(),
            before: Vec::new(),
            back: Vec::new(),
            solver: Solver::default(),
            memory: Vec::new(),
            news: Vec::new(),
        }
    }

    /// Makes room for what so many bodies may need at once, as long as no step is long against them: a disc touches six
    /// others at most. So a crowd that forms late asks for no memory.
    fn make_room(&mut self, bodies: usize) {
        const CONTACTS: usize = 4;
        self.members.reserve(bodies);
        self.back.reserve(bodies);
        self.pairs.reserve(CONTACTS * bodies);
        self.meetings.reserve(CONTACTS * bodies);
        self.memory.reserve(CONTACTS * bodies);
        self.news.reserve(CONTACTS * bodies);
        self.solver.contacts.reserve(CONTACTS * bodies);
        self.solver.apart.reserve(CONTACTS * bodies);
        self.solver.memory.reserve(CONTACTS * bodies);
    }

    /// How often bodies stayed where they were because no solution was found for them.
    pub(crate) fn unsolved(&self) -> u64 {
        self.unsolved
    }

    /// How many groups of bodies in contact moved in steps longer than they should be, because a tick had too many
    /// of them; tick by tick.
    pub(crate) fn coarse(&self) -> u64 {
        self.coarse
    }

    /// Moves bodies from `positions`, where they do not overlap, and says which of them were touched.
    pub(crate) fn advance(&mut self, positions: &mut [ArenaPoint], wanted: Wanted<'_>, touched: &mut [bool]) {
        if self.before.is_empty() {
            self.make_room(positions.len());
        }
        self.before.clear();
        self.before.extend_from_slice(positions);
        // Bodies that are squeezed out may be faster than any that push: then who may meet is looked up anew.
        let mut reach_m = wanted.displacements.iter().map(Vector2::norm).fold(0.0, f64::max);
        let coarse = self.coarse;
        loop {
            self.coarse = coarse;
            touched.fill(false);
            self.find_pairs(reach_m);
            self.find_islands(wanted);
            self.move_free(positions, wanted, touched);
            self.move_islands(positions, wanted, touched);
            let moved_m = positions.iter().zip(&self.before).map(|(now, before)| (now - before).norm());
            let farthest_m = moved_m.fold(0.0, f64::max);
            if farthest_m <= reach_m * (1.0 + TOUCH) || self.pairs.is_empty() {
                break;
            }
            reach_m = 2.0 * farthest_m;
            positions.copy_from_slice(&self.before);
        }
        self.retreat(positions);
    }

    fn diameter_m(&self) -> f64 {
        2.0 * self.radius_m
    }

    /// Bodies that are closer overlap.
    fn least_m(&self) -> f64 {
        self.diameter_m() * (1.0 - TOUCH)
    }

    /// Lists the pairs that may meet if no body moves farther than `reach_m`.
    fn find_pairs(&mut self, reach_m: f64) {
        self.pairs.clear();
        if self.radius_m == 0.0 {
            return;
        }
        let within_m = self.diameter_m() + 2.0 * reach_m;
        let Self { grid, pairs, before, size_m, .. } = self;
        grid.sort(before, *size_m, within_m);
        for (a, here) in before.iter().enumerate() {
            let near = |b: &usize| a < *b && (before[*b] - here).norm_squared() < within_m * within_m;
            for b in grid.around(here).filter(near) {
                pairs.push((a, b));
            }
        }
    }

    /// Joins pairs to islands, and keeps those in which bodies meet on their ways.
    fn find_islands(&mut self, wanted: Wanted<'_>) {
        let Self { islands, pairs, members, meetings, .. } = self;
        islands.clear();
        islands.extend(0..self.before.len());
        for &(a, b) in &*pairs {
            let (a, b) = (root(islands, a), root(islands, b));
            islands[a.max(b)] = a.min(b);
        }
        for body in 0..islands.len() {
            islands[body] = root(islands, body);
        }
        members.clear();
        meetings.clear();
        if pairs.is_empty() {
            return;
        }
        meetings.extend(pairs.iter().map(|&(a, b)| (islands[a], (a, b))));
        meetings.sort_unstable();
        let diameter_m = 2.0 * self.radius_m;
        let (before, size_m, radius_m) = (&self.before, self.size_m, self.radius_m);
        let leaves = |body: usize| {
            let target = before[body] + wanted.displacements[body];
            inside(target, size_m, radius_m) != target
        };
        let meet = |&(_, (a, b)): &(usize, (usize, usize))| {
            let way = wanted.displacements[b] - wanted.displacements[a];
            closest(before[b] - before[a], way).norm() < diameter_m || leaves(a) || leaves(b)
        };
        let mut kept = 0;
        let mut first = 0;
        while first < meetings.len() {
            let island = meetings[first].0;
            let next = first + meetings[first..].partition_point(|meeting| meeting.0 == island);
            if meetings[first..next].iter().any(meet) {
                meetings.copy_within(first..next, kept);
                kept += next - first;
            }
            first = next;
        }
        meetings.truncate(kept);
        members.extend(meetings.iter().flat_map(|&(island, (a, b))| [(island, a), (island, b)]));
        members.sort_unstable();
        members.dedup();
    }

    /// Moves everybody as if alone with the walls.
    fn move_free(&self, positions: &mut [ArenaPoint], wanted: Wanted<'_>, touched: &mut [bool]) {
        for ((position, wanted), touched) in positions.iter_mut().zip(wanted.displacements).zip(touched) {
            let target = *position + wanted;
            *position = inside(target, self.size_m, self.radius_m);
            *touched = *position != target;
        }
    }

    /// Moves those who meet, island by island, from where they were before.
    fn move_islands(&mut self, positions: &mut [ArenaPoint], wanted: Wanted<'_>, touched: &mut [bool]) {
        let least_m = self.least_m();
        let Self { solver, memory, news, before, back, .. } = self;
        news.clear();
        solver.begin(positions.len(), wanted.yields);
        let (mut members, mut meetings) = (&self.members[..], &self.meetings[..]);
        while let Some(&(island, _)) = members.first() {
            let (own, others) = members.split_at(members.partition_point(|member| member.0 == island));
            let (pairs, rest) = meetings.split_at(meetings.partition_point(|meeting| meeting.0 == island));
            (members, meetings) = (others, rest);
            for &(_, body) in own {
                positions[body] = before[body];
                touched[body] = false;
            }
            let length_m = |&(_, body): &(usize, usize)| wanted.displacements[body].norm();
            let longest_m = own.iter().map(length_m).fold(0.0, f64::max);
            let needed = steps(longest_m, 2.0 * self.radius_m);
            let steps = needed.min(STEPS_MAX);
            let scene = Scene {
                radius_m: self.radius_m,
                size_m: self.size_m,
                members: own,
                pairs,
                displacements: wanted.displacements,
                share: 1.0 / steps as f64,
                longest_m: longest_m / steps as f64,
            };
            solver.remember(own, memory);
            let mut coarse = needed > steps;
            let (mut left, mut taken) = (steps, 1);
            while left > 0 {
                if taken == 1 && solver.is_spent() {
                    taken = left.div_ceil(HASTY_STEPS);
                }
                taken = taken.min(left);
                left -= taken;
                back.clear();
                back.extend(own.iter().map(|&(_, body)| positions[body]));
                coarse |= !solver.step(&scene.piece(taken as f64), positions, touched);
                let overlap =
                    |&(_, pair): &(usize, (usize, usize))| overlap(pair, positions, before, least_m);
                if solver.is_spent() && pairs.iter().any(overlap) {
                    // What was found with care before is kept.
                    own.iter().zip(&*back).for_each(|(&(_, body), &at)| positions[body] = at);
                    break;
                }
            }
            self.coarse += u64::from(coarse);
            news.extend_from_slice(&solver.memory);
        }
        news.sort_unstable_by_key(|&(contact, _)| contact);
        std::mem::swap(memory, news);
    }

    /// Bodies that overlap although the solver has done what it could go back to where they were. That can only free
    /// room: before the tick they did not overlap, so this ends, at the latest with everybody back.
    fn retreat(&mut self, positions: &mut [ArenaPoint]) {
        let least_m = self.least_m();
        let mut moved = true;
        while std::mem::take(&mut moved) {
            for &(a, b) in &self.pairs {
                if !overlap((a, b), positions, &self.before, least_m) {
                    continue;
                }
                for body in [a, b] {
                    if positions[body] != self.before[body] {
                        positions[body] = self.before[body];
                        self.unsolved += 1;
                        moved = true;
                    }
                }
            }
        }
    }
}

/// Whether two bodies are closer than `least_m`, and closer than before: rounding alone may have left them so then.
fn overlap((a, b): (usize, usize), positions: &[ArenaPoint], before: &[ArenaPoint], least_m: f64) -> bool {
    let distance_m = (positions[b] - positions[a]).norm();
    distance_m < least_m && distance_m < (before[b] - before[a]).norm()
}

/// Steps that a tick needs in which the farthest of bodies of this diameter moves so far; at least one.
fn steps(longest_m: f64, diameter_m: f64) -> usize {
    ((longest_m / (STEP * diameter_m)).ceil() as usize).max(1)
}

/// The island that a body belongs to, with the way there shortened.
fn root(islands: &mut [usize], body: usize) -> usize {
    let mut at = body;
    while islands[at] != at {
        islands[at] = islands[islands[at]];
        at = islands[at];
    }
    at
}

/// The place of the arena where a body has room that is nearest to `point`.
fn inside(point: ArenaPoint, [width, height]: [f64; 2], radius_m: f64) -> ArenaPoint {
    ArenaPoint::new(point.x.clamp(radius_m, width - radius_m), point.y.clamp(radius_m, height - radius_m))
}

/// Nearest point to the origin of the way from `start` by `way`.
fn closest(start: Vector2<f64>, way: Vector2<f64>) -> Vector2<f64> {
    let square = way.norm_squared();
    if square == 0.0 { start } else { start + way * (-start.dot(&way) / square).clamp(0.0, 1.0) }
}

/// An island in one step, or in a piece of one.
#[derive(Clone, Copy, Debug)]
struct Scene<'a> {
    radius_m: f64,
    size_m: [f64; 2],
    /// (island, body)
    members: &'a [(usize, usize)],
    /// (island, pair)
    pairs: &'a [(usize, (usize, usize))],
    /// Wanted in the whole tick.
    displacements: &'a [Vector2<f64>],
    /// Share of the tick that the step is.
    share: f64,
    /// Longest displacement that a body wants in the step.
    longest_m: f64,
}

impl Scene<'_> {
    /// A piece of the step, or more than one.
    fn piece(&self, share: f64) -> Self {
        Self { share: self.share * share, longest_m: self.longest_m * share, ..*self }
    }

    fn diameter_m(&self) -> f64 {
        2.0 * self.radius_m
    }

    /// Bodies that are apart by less touch.
    fn near_m(&self) -> f64 {
        NEAR * self.diameter_m()
    }
}

/// n·(Δb − Δa) ≥ bound, and the λ ≥ 0 by which it parts its bodies.
#[derive(Clone, Copy, Debug)]
struct Contact {
    key: Key,
    a: usize,
    b: usize,
    /// From a to b where they touch first, or else where they are nearest.
    first: Vector2<f64>,
    /// How far apart its bodies are when the step begins.
    gap_m: f64,
    normal: Vector2<f64>,
    bound_m: f64,
    lambda_m: f64,
    /// By how much λ changed in the last sweep.
    change_m: f64,
    /// Conjugate direction.
    direction_m: f64,
    /// 1/(how many of its bodies yield).
    share: f64,
}

impl Contact {
    fn new(key: Key, (a, b): (usize, usize), first: Vector2<f64>, gap_m: f64, bound_m: f64) -> Self {
        let normal = direction(first);
        Self {
            key,
            a,
            b,
            first,
            gap_m,
            normal,
            bound_m,
            lambda_m: 0.0,
            change_m: 0.0,
            direction_m: 0.0,
            share: 0.0,
        }
    }

    /// Parts its bodies by `way_m`.
    #[inline]
    fn part(&self, way_m: f64, deltas: &mut [Vector2<f64>], weights: &[f64]) {
        deltas[self.a] -= self.normal * (weights[self.a] * way_m);
        deltas[self.b] += self.normal * (weights[self.b] * way_m);
    }
}

/// Finds displacements. Kept from one step to the next are its memory, and multipliers to begin with.
#[derive(Clone, Debug, Default)]
struct Solver {
    /// Displacement of each body in this step; then comes that of the walls, which have none.
    deltas: Vec<Vector2<f64>>,
    /// 1 for a body that yields, 0 for others and for walls.
    weights: Vec<f64>,
    contacts: Vec<Contact>,
    /// Contacts of bodies that are apart when a step begins.
    apart: Vec<Contact>,
    /// λ of the contacts of the piece before, for a whole tick, ordered by their keys.
    memory: Vec<(Key, f64)>,
    /// Pairs that were looked at and contacts that sweeps have corrected for the island in this tick.
    corrections: u64,
}

impl Solver {
    /// Begins a tick.
    fn begin(&mut self, bodies: usize, yields: &[bool]) {
        self.deltas.clear();
        self.deltas.resize(bodies + 1, Vector2::zeros());
        self.weights.clear();
        self.weights.extend(yields.iter().map(|&yields| f64::from(u8::from(yields))));
        self.weights.push(0.0);
    }

    /// Begins an island with what is known of its contacts.
    fn remember(&mut self, members: &[(usize, usize)], known: &[(Key, f64)]) {
        self.corrections = 0;
        self.memory.clear();
        // Contacts of two bodies are ordered by the first, and those with walls have their body first as well.
        for &(_, body) in members {
            let first = known.partition_point(|&((a, _), _)| a < body);
            self.memory.extend(known[first..].iter().take_while(|&&((a, _), _)| a == body));
        }
    }

    /// Whether so much has been computed for the island in this tick that the rest has to be had for less.
    fn is_spent(&self) -> bool {
        self.corrections > CORRECTIONS_MAX
    }

    /// Moves the bodies of an island for one step and notes who is touched. Where bodies first touch within the step,
    /// it is cut. Returns whether it was cut as often as it should be.
    fn step(&mut self, scene: &Scene<'_>, positions: &mut [ArenaPoint], touched: &mut [bool]) -> bool {
        let mut left = 1.0;
        for _ in 1..PIECES_MAX {
            if self.is_spent() {
                break;
            }
            let rest = scene.piece(left);
            self.find_displacements(&rest, positions);
            let near_m = rest.near_m();
            if !self.contacts.iter().any(|contact| contact.lambda_m > 0.0 && contact.gap_m > near_m) {
                self.settle(&rest, positions, touched);
                return true;
            }
            let share = self.share_until_touch(&rest, positions).max(PIECE_MIN / left);
            let last = share > 1.0 - PIECE_MIN;
            let piece = if last { rest } else { rest.piece(share) };
            self.find_displacements(&piece, positions);
            self.settle(&piece, positions, touched);
            if last {
                return true;
            }
            left *= 1.0 - share;
        }
        let rest = scene.piece(left);
        self.find_displacements(&rest, positions);
        self.settle(&rest, positions, touched);
        false
    }

    /// Finds displacements with the directions of contacts halfway.
    fn find_displacements(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint]) {
        let mut reach_m = 2.0 * scene.longest_m;
        loop {
            self.find_contacts(scene, positions, reach_m);
            self.solve_halfway(scene, positions);
            let delta_m = |&(_, body): &(usize, usize)| self.deltas[body].norm();
            let farthest_m = scene.members.iter().map(delta_m).fold(0.0, f64::max);
            if farthest_m <= reach_m * (1.0 + TOUCH) {
                break;
            }
            reach_m = 2.0 * farthest_m;
        }
    }

    fn solve_halfway(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint]) {
        self.solve_from_wanted(scene, ROUGH);
        self.turn_halfway(scene, positions);
        self.solve_from_wanted(scene, CONVERGED);
    }

    /// The share of the step after which bodies first touch that do not when it begins, if they go on as they do then:
    /// as if they did not know of each other.
    fn share_until_touch(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint]) -> f64 {
        let (near_m, diameter_m, wall) = (scene.near_m(), scene.diameter_m(), positions.len());
        self.apart.clear();
        self.apart.extend(self.contacts.iter().filter(|contact| contact.gap_m > near_m).copied());
        self.contacts.retain(|contact| contact.gap_m <= near_m);
        self.solve_halfway(scene, positions);
        let share = |contact: &Contact| {
            let way = self.deltas[contact.b] - self.deltas[contact.a];
            if contact.a == wall {
                let nearer_m = -contact.normal.dot(&way);
                return if nearer_m > 0.0 { contact.gap_m / nearer_m } else { 1.0 };
            }
            let apart = positions[contact.b] - positions[contact.a];
            let touch = first_touch(apart, way, diameter_m);
            let touches = touch.norm() <= diameter_m * (1.0 + TOUCH);
            if touches { (touch - apart).norm() / way.norm() } else { 1.0 }
        };
        self.apart.iter().map(share).fold(1.0, f64::min)
    }

    /// Moves the bodies of an island by the displacements that were found, and notes who is touched.
    fn settle(&mut self, scene: &Scene<'_>, positions: &mut [ArenaPoint], touched: &mut [bool]) {
        let wall = positions.len();
        self.memory.clear();
        for contact in self.contacts.iter().filter(|contact| contact.lambda_m > 0.0) {
            self.memory.push((contact.key, contact.lambda_m / scene.share));
            for body in [contact.a, contact.b].into_iter().filter(|&body| body != wall) {
                touched[body] = true;
            }
        }
        self.memory.sort_unstable_by_key(|&(key, _)| key);
        self.turn_to_end(scene, positions);
        self.solve(scene, CONVERGED);
        for &(_, body) in scene.members {
            positions[body] = inside(positions[body] + self.deltas[body], scene.size_m, scene.radius_m);
        }
    }

    /// Lists the contacts there may be if no body moves farther than `reach_m`, each in the direction in which its
    /// bodies would touch first.
    fn find_contacts(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint], reach_m: f64) {
        let (diameter_m, wall) = (scene.diameter_m(), positions.len());
        let within_m = diameter_m + 2.0 * reach_m;
        self.contacts.clear();
        self.corrections += scene.pairs.len() as u64;
        for &(_, (a, b)) in scene.pairs {
            let apart = positions[b] - positions[a];
            if apart.norm_squared() < within_m * within_m {
                let way = (scene.displacements[b] - scene.displacements[a]) * scene.share;
                let first = first_touch(apart, way, diameter_m);
                let bound_m = diameter_m - direction(first).dot(&apart);
                let contact = Contact::new((a, b), (a, b), first, apart.norm() - diameter_m, bound_m);
                self.push(contact, scene);
            }
        }
        let [width, height] = scene.size_m;
        for &(_, body) in scene.members {
            let at = positions[body];
            let rooms = [
                (Vector2::x(), at.x - scene.radius_m),
                (-Vector2::x(), width - scene.radius_m - at.x),
                (Vector2::y(), at.y - scene.radius_m),
                (-Vector2::y(), height - scene.radius_m - at.y),
            ];
            for (side, (normal, room_m)) in rooms.into_iter().enumerate() {
                if room_m < reach_m {
                    let contact = Contact::new((body, wall + side), (wall, body), normal, room_m, -room_m);
                    self.push(contact, scene);
                }
            }
        }
    }

    /// Takes up a contact, if one of its bodies yields, with the multiplier that is known of it.
    fn push(&mut self, contact: Contact, scene: &Scene<'_>) {
        let yielding = self.weights[contact.a] + self.weights[contact.b];
        if yielding == 0.0 {
            return;
        }
        let known = self.memory.binary_search_by_key(&contact.key, |&(key, _)| key);
        let lambda_m = known.map_or(0.0, |at| self.memory[at].1 * scene.share);
        self.contacts.push(Contact { lambda_m, share: 1.0 / yielding, ..contact });
    }

    /// Turns contacts of bodies to halfway between first touch and end. As |r₁|² − |r₀|² = (r₀ + r₁)·(r₁ − r₀), a
    /// contact in the direction of r₀ + r₁ is exact, if r₁ is what comes out.
    fn turn_halfway(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint]) {
        let (diameter_m, wall) = (2.0 * scene.radius_m, positions.len());
        for contact in self.contacts.iter_mut().filter(|contact| contact.a != wall) {
            let apart = positions[contact.b] - positions[contact.a];
            let first = contact.first;
            let sum = first + apart + self.deltas[contact.b] - self.deltas[contact.a];
            let length_m = sum.norm();
            // Bodies do not pass through each other.
            if length_m > diameter_m {
                contact.normal = sum / length_m;
                let short_m = (diameter_m * diameter_m - first.norm_squared()) / length_m;
                contact.bound_m = short_m + contact.normal.dot(&(first - apart));
            }
        }
    }

    /// Turns contacts of bodies to where these are in the end: then they surely do not overlap. What is left to do
    /// has no multipliers yet.
    fn turn_to_end(&mut self, scene: &Scene<'_>, positions: &[ArenaPoint]) {
        let (diameter_m, wall) = (2.0 * scene.radius_m, positions.len());
        for contact in &mut self.contacts {
            contact.lambda_m = 0.0;
            if contact.a != wall {
                let apart = positions[contact.b] - positions[contact.a];
                contact.normal = direction(apart + self.deltas[contact.b] - self.deltas[contact.a]);
                contact.bound_m = diameter_m - contact.normal.dot(&apart);
            }
        }
    }

    /// Finds displacements from the wanted ones and the multipliers there are.
    fn solve_from_wanted(&mut self, scene: &Scene<'_>, converged: f64) {
        for &(_, body) in scene.members {
            self.deltas[body] = scene.displacements[body] * scene.share;
        }
        for contact in &self.contacts {
            contact.part(contact.lambda_m, &mut self.deltas, &self.weights);
        }
        self.solve(scene, converged);
    }

    /// Changes displacements until all contacts are kept, or nobody can say how.
    fn solve(&mut self, scene: &Scene<'_>, converged: f64) {
        let converged_m = scene.diameter_m() * converged;
        let mut square_before = 0.0;
        self.contacts.iter_mut().for_each(|contact| contact.direction_m = 0.0);
        for _ in 0..SWEEPS_MAX {
            self.corrections += self.contacts.len() as u64;
            let (largest_m, square) = self.sweep();
            if largest_m <= converged_m || self.corrections > CORRECTIONS_END {
                return;
            }
            let beta = if square <= square_before { square / square_before } else { 0.0 };
            square_before = square;
            let Self { deltas, weights, contacts, .. } = self;
            for contact in contacts {
                let along_m = beta * contact.direction_m;
                contact.direction_m = along_m + contact.change_m;
                if along_m != 0.0 {
                    contact.lambda_m += along_m;
                    contact.part(along_m, deltas, weights);
                }
            }
        }
    }

    /// One round of Gauss-Seidel: each contact in turn is kept. Returns the largest change and the sum of squares.
    fn sweep(&mut self) -> (f64, f64) {
        let (mut largest_m, mut square) = (0.0_f64, 0.0);
        let Self { deltas, weights, contacts, .. } = self;
        for contact in contacts {
            let Contact { a, b, normal, bound_m, lambda_m, share, .. } = *contact;
            let missing_m = bound_m - normal.dot(&(deltas[b] - deltas[a]));
            let change_m = (missing_m * share).max(-lambda_m);
            contact.change_m = change_m;
            if change_m != 0.0 {
                contact.lambda_m += change_m;
                contact.part(change_m, deltas, weights);
                largest_m = largest_m.max(change_m.abs());
                square += change_m * change_m;
            }
        }
        (largest_m, square)
    }
}

/// Where a body at `start` first comes as near to one at the origin as `diameter_m`, if it goes `way`; or else where
/// it is nearest.
fn first_touch(start: Vector2<f64>, way: Vector2<f64>, diameter_m: f64) -> Vector2<f64> {
    let nearest = closest(start, way);
    let (square, diameter_squared) = (nearest.norm_squared(), diameter_m * diameter_m);
    if start.norm_squared() <= diameter_squared {
        start
    } else if square >= diameter_squared {
        nearest
    } else {
        // The foot of the perpendicular may lie past the end of the way.
        let foot = start + way * (-start.dot(&way) / way.norm_squared());
        foot - way.normalize() * libm::sqrt(diameter_squared - foot.norm_squared())
    }
}

/// Direction from one body to another; bodies on one spot part along the x axis.
fn direction(apart: Vector2<f64>) -> Vector2<f64> {
    apart.try_normalize(0.0).unwrap_or_else(Vector2::x)
}

#[cfg(test)]
mod tests;
