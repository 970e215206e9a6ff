//! Percepts and answers as columns: to the bit, and without memory of their own for each robot.

use protocol::{
    command::{Answer, Command},
    frame::BodyVector,
    granted::{Compass, Position},
    odometry::Odometry,
    packet::{HEADER_BYTES, PacketView},
    payload::{PAYLOAD_BYTES_MAX, Payload},
    percept::{Delivery, FieldComponent, Light, Percept, Stimulus, Tick, Wall},
    robot_id::RobotId,
    units::{Meters, Radians},
};

use crate::messages::lamplight::{Answers, Percepts};

/// Numbers of a term of the field.
const TERM: usize = 5;

/// Columns that are no percepts or answers: of a length that does not fit, or with values that mean nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("its columns do not fit each other, or hold what means nothing")]
pub struct Malformed;

impl Percepts {
    /// The percepts of a tick, one for each robot.
    pub fn of(tick: Tick, percepts: &[Percept]) -> Self {
        let mut columns = Self { tick, ..Self::default() };
        let heard = percepts.iter().map(|percept| percept.deliveries.len()).sum::<usize>();
        columns.light.reserve(percepts.len());
        columns.heard.reserve(percepts.len());
        columns.packets.reserve(heard * (HEADER_BYTES + size_of::<f32>()));
        columns.measured.reserve(heard * 3);
        percepts.iter().for_each(|percept| columns.add(percept));
        columns
    }

    fn add(&mut self, percept: &Percept) {
        self.light.push(percept.light.value);
        self.stimulus_kinds.push(match percept.light.stimulus {
            Stimulus::None => 0,
            Stimulus::Gradient(gradient) => {
                self.stimuli.extend([gradient.0.x, gradient.0.y]);
                1
            }
            Stimulus::Bearing(bearing) => {
                self.stimuli.push(bearing.get());
                2
            }
        });
        self.bumps.push(percept.bump.into());
        if let Some(Odometry { position, heading }) = &percept.odometry {
            self.odometry.extend([position.0.x, position.0.y, heading.get()]);
        }
        self.compass.extend(percept.compass.iter().map(|compass| compass.heading.get()));
        self.position.extend(percept.position.iter().flat_map(|at| [at.x.get(), at.y.get()]));
        self.wall_counts.push(percept.walls.len() as u8);
        self.walls.extend(percept.walls.iter().flat_map(|wall| [wall.distance.get(), wall.bearing.get()]));
        self.field_counts.push(percept.field.len() as u8);
        self.field.extend(percept.field.iter().flat_map(numbers));
        self.heard.push(percept.deliveries.len() as u32);
        for delivery in &percept.deliveries {
            add_packet(&mut self.packets, &delivery.packet.view(percept.payload(delivery)));
            self.measured.extend([delivery.range.get(), delivery.bearing.get(), delivery.orientation.get()]);
        }
    }

    /// Writes the percepts over `percepts`, one for each robot.
    ///
    /// # Errors
    /// If these are none.
    pub fn read(&self, percepts: &mut Vec<Percept>) -> Result<(), Malformed> {
        let robots = self.light.len();
        percepts.resize_with(robots, || Percept::empty(self.tick));
        let mut columns = Columns {
            stimuli: &self.stimuli,
            odometry: &self.odometry,
            compass: &self.compass,
            position: &self.position,
            walls: &self.walls,
            field: &self.field,
            packets: &self.packets,
            measured: &self.measured,
        };
        for (robot, percept) in percepts.iter_mut().enumerate() {
            self.read_one(&mut columns, robot, percept)?;
        }
        if columns.is_read_to_its_end() { Ok(()) } else { Err(Malformed) }
    }

    fn read_one(
        &self,
        columns: &mut Columns<'_>,
        robot: usize,
        percept: &mut Percept,
    ) -> Result<(), Malformed> {
        let byte = |column: &[u8]| column.get(robot).copied().ok_or(Malformed);
        percept.clear_deliveries();
        percept.tick = self.tick;
        let stimulus = match byte(&self.stimulus_kinds)? {
            0 => Stimulus::None,
            1 => Stimulus::Gradient(vector(take(&mut columns.stimuli)?)),
            2 => {
                let [bearing] = take(&mut columns.stimuli)?;
                Stimulus::Bearing(radians(bearing)?)
            }
            _ => return Err(Malformed),
        };
        percept.light = Light { value: self.light[robot], stimulus };
        percept.bump = byte(&self.bumps)? != 0;
        percept.odometry = granted(&self.odometry, || {
            let [x, y, heading] = take(&mut columns.odometry)?;
            Ok(Odometry { position: vector([x, y]), heading: radians(heading)? })
        })?;
        percept.compass = granted(&self.compass, || {
            let [heading] = take(&mut columns.compass)?;
            Ok(Compass { heading: radians(heading)? })
        })?;
        percept.position = granted(&self.position, || {
            let [x, y] = take(&mut columns.position)?;
            Ok(Position { x: meters(x)?, y: meters(y)? })
        })?;
        percept.walls.clear();
        for _ in 0..byte(&self.wall_counts)? {
            let [distance, bearing] = take(&mut columns.walls)?;
            let wall = Wall { distance: meters(distance)?, bearing: radians(bearing)? };
            percept.walls.try_push(wall).map_err(|_| Malformed)?;
        }
        percept.field.clear();
        for _ in 0..byte(&self.field_counts)? {
            percept.field.try_push(term(take(&mut columns.field)?)?).map_err(|_| Malformed)?;
        }
        for _ in 0..*self.heard.get(robot).ok_or(Malformed)? {
            let packet = percept.packet(&take_packet(&mut columns.packets)?);
            let [range, bearing, orientation] = take(&mut columns.measured)?;
            let delivery = Delivery {
                packet,
                range: meters(range)?,
                bearing: radians(bearing)?,
                orientation: radians(orientation)?,
            };
            percept.deliveries.try_push(delivery).map_err(|_| Malformed)?;
        }
        Ok(())
    }
}

impl Answers {
    /// The answers to the percepts of `tick`.
    pub fn of(tick: Tick, answers: &[Option<Answer>]) -> Self {
        let mut columns = Self { tick, ..Self::default() };
        for answer in answers {
            let Some(answer) = answer else {
                columns.kinds.push(0);
                continue;
            };
            let Command { velocity, estimated_error, .. } = &answer.command;
            columns.kinds.push(1 + u8::from(estimated_error.is_some()));
            add_packet(&mut columns.packets, &answer.packet());
            columns.velocities.extend([velocity.0.x, velocity.0.y]);
            columns.errors.extend(estimated_error.iter().flat_map(|error| [error.0.x, error.0.y]));
        }
        columns
    }

    /// Returns the answers, one for each robot.
    ///
    /// # Errors
    /// If these are none.
    pub fn read(&self) -> Result<Vec<Option<Answer>>, Malformed> {
        let (mut packets, mut velocities, mut errors) =
            (&self.packets[..], &self.velocities[..], &self.errors[..]);
        let mut answer = |kind: &u8| {
            let has_error = match kind {
                0 => return Ok(None),
                1 => false,
                2 => true,
                _ => return Err(Malformed),
            };
            let PacketView { sender, sequence, payload } = take_packet(&mut packets)?;
            let command = Command {
                velocity: vector(take(&mut velocities)?),
                estimated_error: has_error.then(|| take(&mut errors).map(vector)).transpose()?,
                payload: Payload::try_from(payload).map_err(|_| Malformed)?,
            };
            Ok(Some(Answer { sender, sequence, command }))
        };
        self.kinds.iter().map(&mut answer).collect()
    }
}

/// Columns of percepts, as far as they have not been read.
struct Columns<'a> {
    stimuli: &'a [f64],
    odometry: &'a [f64],
    compass: &'a [f64],
    position: &'a [f64],
    walls: &'a [f64],
    field: &'a [f64],
    packets: &'a [u8],
    measured: &'a [f64],
}

impl Columns<'_> {
    fn is_read_to_its_end(&self) -> bool {
        let numbers =
            [self.stimuli, self.odometry, self.compass, self.position, self.walls, self.field, self.measured];
        self.packets.is_empty() && numbers.iter().all(|column| column.is_empty())
    }
}

fn add_packet(packets: &mut Vec<u8>, packet: &PacketView<'_>) {
    packets.extend_from_slice(&packet.header());
    packets.extend_from_slice(packet.payload);
}

fn take_packet<'a>(packets: &mut &'a [u8]) -> Result<PacketView<'a>, Malformed> {
    let (header, rest) = packets.split_first_chunk::<HEADER_BYTES>().ok_or(Malformed)?;
    let (payload, rest) = rest.split_at_checked(header[1].into()).ok_or(Malformed)?;
    let word = |at: usize| u32::from_le_bytes([header[at], header[at + 1], header[at + 2], header[at + 3]]);
    let sender = RobotId { index: word(4), incarnation: u16::from_le_bytes([header[2], header[3]]) };
    let packet = PacketView { sender, sequence: word(8), payload };
    if packet.header() != *header || payload.len() > PAYLOAD_BYTES_MAX {
        return Err(Malformed);
    }
    *packets = rest;
    Ok(packet)
}

/// The next numbers of a column.
fn take<const COUNT: usize>(column: &mut &[f64]) -> Result<[f64; COUNT], Malformed> {
    let (numbers, rest) = column.split_first_chunk().ok_or(Malformed)?;
    *column = rest;
    Ok(*numbers)
}

/// A reading that all robots have, or none.
fn granted<T>(
    column: &[f64],
    reading: impl FnOnce() -> Result<T, Malformed>,
) -> Result<Option<T>, Malformed> {
    if column.is_empty() { Ok(None) } else { reading().map(Some) }
}

fn numbers(term: &FieldComponent) -> [f64; TERM] {
    match *term {
        FieldComponent::Constant(value) => [0.0, 0.0, 0.0, value, 0.0],
        FieldComponent::Gaussian { center, amplitude, sigma_m } => {
            [1.0, center.0.x, center.0.y, amplitude, sigma_m]
        }
        FieldComponent::Lamp { position, peak, half_distance_m } => {
            [2.0, position.0.x, position.0.y, peak, half_distance_m]
        }
    }
}

fn term([kind, x, y, a, b]: [f64; TERM]) -> Result<FieldComponent, Malformed> {
    let at = vector([x, y]);
    match kind {
        0.0 => Ok(FieldComponent::Constant(a)),
        1.0 => Ok(FieldComponent::Gaussian { center: at, amplitude: a, sigma_m: b }),
        2.0 => Ok(FieldComponent::Lamp { position: at, peak: a, half_distance_m: b }),
        _ => Err(Malformed),
    }
}

fn vector([x, y]: [f64; 2]) -> BodyVector {
    BodyVector::new(x, y)
}

fn meters(value: f64) -> Result<Meters, Malformed> {
    Meters::new(value).ok_or(Malformed)
}

fn radians(value: f64) -> Result<Radians, Malformed> {
    Radians::new(value).ok_or(Malformed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn percept(robot: u32) -> Percept {
        let mut percept = Percept::empty(7);
        let heading = Radians::new(0.1 + f64::from(robot)).unwrap();
        percept.light = Light {
            value: 1.0 / 3.0,
            stimulus: match robot % 3 {
                0 => Stimulus::None,
                1 => Stimulus::Gradient(BodyVector::new(0.5, -0.0)),
                _ => Stimulus::Bearing(heading),
            },
        };
        percept.bump = robot == 1;
        percept.odometry = Some(Odometry { position: BodyVector::new(-0.25, 7.0), heading });
        percept.position = Some(Position { x: Meters::new(3.0).unwrap(), y: Meters::new(-0.0).unwrap() });
        for payload in [&[][..], &[1; 4], &[3; 10], &[4; 128]].into_iter().take(robot as usize) {
            let view = PacketView { sender: RobotId { index: 9, incarnation: 2 }, sequence: 5, payload };
            let packet = percept.packet(&view);
            let range = Meters::new(0.3).unwrap();
            percept.deliveries.push(Delivery { packet, range, bearing: heading, orientation: heading });
        }
        percept.walls.push(Wall { distance: Meters::new(1.0).unwrap(), bearing: heading });
        percept.field.extend([
            FieldComponent::Constant(3.0),
            FieldComponent::Lamp { position: BodyVector::new(1.0, 2.0), peak: 500.0, half_distance_m: 0.5 },
        ]);
        percept
    }

    #[test]
    fn percepts_are_read_as_they_were() {
        let percepts: Vec<_> = (0..5).map(percept).collect();
        let mut read = vec![percept(4)];
        Percepts::of(7, &percepts).read(&mut read).unwrap();
        assert_eq!(read, percepts);
    }

    #[test]
    fn answers_are_read_as_they_were() {
        let answer = |index: u32, estimated_error| {
            let command = Command {
                estimated_error,
                velocity: BodyVector::new(0.1, -0.0),
                payload: Payload::try_from(&[index as u8; 100][..index as usize]).unwrap(),
            };
            Some(Answer { sender: RobotId { index, incarnation: 1 }, sequence: 8, command })
        };
        let answers = [answer(0, None), None, answer(2, Some(BodyVector::new(1.0, 2.0))), answer(100, None)];
        assert_eq!(Answers::of(3, &answers).read().unwrap(), answers);
    }

    #[test]
    fn columns_that_do_not_fit_are_refused() {
        let good = Percepts::of(7, &(0..5).map(percept).collect::<Vec<_>>());
        let broken: [fn(&mut Percepts); 8] = [
            |it| it.packets.truncate(30),
            |it| it.packets.push(0),
            |it| it.measured[0] = f64::NAN,
            |it| it.walls.truncate(3),
            |it| it.heard[1] = 3,
            |it| it.heard.truncate(2),
            |it| it.stimulus_kinds[0] = 3,
            |it| it.wall_counts[0] = 200,
        ];
        for break_it in broken {
            let mut columns = good.clone();
            break_it(&mut columns);
            assert_eq!(columns.read(&mut Vec::new()), Err(Malformed));
        }
    }
}
