//! Delta debugging: which of some things does a failure need?
//!
//! In:  the things, and a predicate that says whether some of them still show the failure.
//! Out: few that do: without any single one of them it does not show (1-minimal), if the predicate
//!      answers the same question always the same.
//! Source: Zeller and Hildebrandt, Simplifying and Isolating Failure-Inducing Input (IEEE TSE 28, 2002),
//!         algorithm ddmin. Here the empty set is asked about as well, and first.

/// Few of `things`, in their order, that still show what all of them show.
///
/// # Errors
/// The first error of `shows`.
pub(crate) fn ddmin<T: Clone, E>(
    things: &[T],
    mut shows: impl FnMut(&[T]) -> Result<bool, E>,
) -> Result<Vec<T>, E> {
    if things.is_empty() || shows(&[])? {
        return Ok(Vec::new());
    }
    let mut kept = things.to_vec();
    let mut parts = 2;
    // With one left there is nothing more to ask: without it, it did not show.
    while kept.len() > 1 {
        let chunk = kept.len().div_ceil(parts);
        let subsets = kept.chunks(chunk).map(<[T]>::to_vec);
        let complements = (0..kept.len()).step_by(chunk).map(|start| {
            let end = (start + chunk).min(kept.len());
            [&kept[..start], &kept[end..]].concat()
        });
        // Of two parts, each one is the complement of the other.
        let complements = complements.filter(|_| parts > 2);
        let candidates: Vec<(Vec<T>, bool)> =
            subsets.map(|subset| (subset, true)).chain(complements.map(|rest| (rest, false))).collect();
        let mut smaller = None;
        for (candidate, is_subset) in candidates {
            if shows(&candidate)? {
                smaller = Some((candidate, is_subset));
                break;
            }
        }
        match smaller {
            Some((subset, true)) => (kept, parts) = (subset, 2),
            Some((complement, false)) => (kept, parts) = (complement, (parts - 1).max(2)),
            None if parts >= kept.len() => break,
            None => parts = (parts * 2).min(kept.len()),
        }
    }
    Ok(kept)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use proptest::prelude::*;

    use super::*;

    fn minimal(count: u32, shows: impl Fn(&[u32]) -> bool) -> (Vec<u32>, usize) {
        let mut asked = 0;
        let all: Vec<u32> = (0..count).collect();
        let few = ddmin(&all, |some| {
            asked += 1;
            Ok::<_, Infallible>(shows(some))
        });
        (few.unwrap(), asked)
    }

    #[test]
    fn two_of_ten_that_matter_together_are_found() {
        let (few, asked) = minimal(10, |some| some.contains(&2) && some.contains(&7));
        assert_eq!(few, [2, 7]);
        assert!(asked < 60, "{asked}");
    }

    #[test]
    fn one_that_matters_is_found_by_halving() {
        let (few, asked) = minimal(64, |some| some.contains(&63));
        assert_eq!(few, [63]);
        assert!(asked <= 2 * 6 + 1, "{asked}");
    }

    #[test]
    fn nothing_is_kept_if_nothing_is_needed() {
        assert!(minimal(10, |_| true).0.is_empty());
        assert!(minimal(0, |_| true).0.is_empty());
    }

    #[test]
    fn all_are_kept_if_all_are_needed() {
        assert_eq!(minimal(5, |some| some.len() == 5).0, [0, 1, 2, 3, 4]);
        assert_eq!(minimal(1, |some| some.len() == 1).0, [0]);
    }

    #[test]
    fn an_error_ends_the_search() {
        assert_eq!(
            ddmin(&[1, 2, 3], |some| if some.len() == 1 { Err("enough") } else { Ok(false) }),
            Err("enough")
        );
    }

    proptest! {
        #[test]
        fn what_is_left_shows_it_and_no_part_of_it_less_one_does(
            count in 1_u32..40,
            // A failure that some alternatives show: not monotone between them.
            needed in prop::collection::vec(prop::collection::btree_set(0_u32..40, 1..5), 1..4),
            odd in any::<bool>(),
        ) {
            let shows = |some: &[u32]| {
                needed.iter().any(|all| all.iter().all(|one| some.contains(&(one % count))))
                    && (!odd || some.len() % 2 == 1 || some.len() as u32 == count)
            };
            prop_assume!(shows(&(0..count).collect::<Vec<_>>()));
            let (few, _) = minimal(count, shows);
            prop_assert!(shows(&few));
            prop_assert!(few.is_sorted());
            for left_out in 0..few.len() {
                let mut fewer = few.clone();
                fewer.remove(left_out);
                prop_assert!(!shows(&fewer));
            }
        }
    }
}
