//! Flipped bits in a frame: which numbers of them the checksum always finds, and how many choices of others it does
//! not.

#![allow(clippy::unwrap_used, reason = "these are tests, helpers included")]

use std::collections::BTreeMap;

use protocol::{
    packet::{PacketError, PacketView, frame_bytes},
    robot_id::RobotId,
};

/// Bits of a frame of the paper's robots.
const BITS: usize = 8 * frame_bytes(4);
/// Bits of kind and length, which come first: no other value of them is read.
const KNOWN_BITS: usize = 16;
/// Most flips that choices are counted for.
const FLIPS_MAX: usize = 10;

const PACKET: PacketView<'_> =
    PacketView { sender: RobotId::first(7), sequence: 300, payload: &1.0_f32.to_le_bytes() };

/// Decodes the packet with these bits flipped; returns the reading it then carries.
fn decoded(flips: &[usize]) -> Result<f32, PacketError> {
    let mut bytes = PACKET.encode();
    for bit in flips {
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
    let packet = PacketView::decode(&bytes)?;
    Ok(f32::from_le_bytes(packet.payload.try_into().unwrap()))
}

/// By what the checksum is off if one bit is flipped, for each bit. Of several flipped bits these add up, bit by bit.
fn syndromes() -> Vec<u16> {
    let syndrome = |bit| match decoded(&[bit]) {
        Err(PacketError::Checksum { received, computed }) => received ^ computed,
        other => panic!("bit {bit}: {other:?}"),
    };
    (0..BITS).map(syndrome).collect()
}

/// Choices of so many of the bits behind kind and length that leave the checksum right, for 0 to [`FLIPS_MAX`].
fn unnoticed() -> Vec<u64> {
    let mut choices = vec![vec![0_u64; 1 << 16]; FLIPS_MAX + 1];
    choices[0][0] = 1;
    for syndrome in &syndromes()[KNOWN_BITS..] {
        for flips in (1..=FLIPS_MAX).rev() {
            for sum in 0..=u16::MAX {
                let without = choices[flips - 1][usize::from(sum ^ syndrome)];
                choices[flips][usize::from(sum)] += without;
            }
        }
    }
    choices.iter().map(|by_sum| by_sum[0]).collect()
}

/// Choices of `flips` out of all bits.
fn all(flips: usize) -> f64 {
    (0..flips).map(|at| (BITS - at) as f64 / (at + 1) as f64).product()
}

#[test]
fn an_odd_number_of_flipped_bits_is_always_found_and_so_are_two() {
    let syndromes = syndromes();
    // A sum of an odd number of these has an odd number of ones, and so is not zero.
    assert!(syndromes.iter().all(|syndrome| syndrome.count_ones() % 2 == 1));
    let mut distinct = syndromes.clone();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), BITS, "two that differ do not add up to zero");
    // The same by the frames themselves.
    for a in 0..BITS {
        for b in a + 1..BITS {
            assert!(decoded(&[a, b]).is_err(), "{a} {b}");
            assert!((b + 1..BITS).all(|c| decoded(&[a, b, c]).is_err()), "{a} {b} and a third");
        }
    }
}

#[test]
fn of_even_numbers_from_four_on_as_many_pass_as_the_guide_says() {
    let unnoticed = unnoticed();
    println!("flips  choices that pass  share of all");
    for (flips, choices) in unnoticed.iter().enumerate().skip(1) {
        println!("{flips:5}  {choices:17}  {:.4e}", *choices as f64 / all(flips));
    }
    let share = |flips: usize| format!("{:.3e}", unnoticed[flips] as f64 / all(flips));
    for flips in [1, 2, 3, 5, 7, 9] {
        assert_eq!(unnoticed[flips], 0, "{flips} flips");
    }
    assert_eq!(share(4), "3.341e-5");
    assert_eq!(share(6), "1.485e-5");
    assert_eq!(share(8), "1.159e-5");
    assert_eq!(share(10), "9.020e-6");
}

#[test]
fn what_adds_up_to_nothing_is_what_is_read_with_four_flipped_bits() {
    let syndromes = syndromes();
    let mut pairs: BTreeMap<u16, Vec<[usize; 2]>> = BTreeMap::new();
    for a in 0..BITS {
        for b in a + 1..BITS {
            pairs.entry(syndromes[a] ^ syndromes[b]).or_default().push([a, b]);
        }
    }
    // Every four that add up to nothing are two pairs with the same sum, in three ways.
    let (mut read, mut not_finite, mut unknown) = (0, 0, 0);
    for alike in pairs.values() {
        for (at, first) in alike.iter().enumerate() {
            for second in &alike[at + 1..] {
                match decoded(&[*first, *second].concat()) {
                    Ok(reading) if reading.is_finite() => read += 1,
                    Ok(_) => not_finite += 1,
                    Err(PacketError::Kind(_) | PacketError::Length { .. }) => unknown += 1,
                    Err(error) => panic!("{first:?} {second:?}: {error}"),
                }
            }
        }
    }
    let [read, not_finite, unknown] = [read, not_finite, unknown].map(|count: u64| count / 3);
    println!(
        "four flips: {read} read, {not_finite} with a reading that is no number, {unknown} of another kind or length"
    );
    assert_eq!(read + not_finite, unnoticed()[4]);
    // With a reading of 1.0, whose exponent lacks a single bit to be no number.
    assert_eq!([read, not_finite, unknown], [561, 13, 257]);
}
