//! The same scenario with fewer robots.

use scenario::Scenario;

/// Few robots, of `count`, with which `shows` holds: halved as long as it does, then fewer by ever smaller steps.
/// With one robot less it does not hold. In general that is no global minimum.
///
/// # Errors
/// The first error of `shows`.
pub(crate) fn fewest<E>(count: u32, mut shows: impl FnMut(u32) -> Result<bool, E>) -> Result<u32, E> {
    let mut kept = count;
    while kept > 1 && shows(kept / 2)? {
        kept /= 2;
    }
    let mut step = (kept / 4).max(1);
    while kept > step {
        if shows(kept - step)? {
            kept -= step;
        } else if step > 1 {
            step /= 2;
        } else {
            break;
        }
        step = step.min((kept - 1).max(1));
    }
    Ok(kept)
}

/// `scenario` with its first `count` robots alone; `None` if a fault would then strike nobody.
pub(crate) fn with_robots(scenario: &Scenario, count: u32) -> Option<Scenario> {
    let mut smaller = scenario.clone();
    if count == 0 {
        return None;
    }
    smaller.robots.count = count;
    if let Some(positions) = &mut smaller.robots.positions_m {
        positions.truncate(count as usize);
    }
    if let Some(headings) = &mut smaller.robots.headings_rad {
        headings.truncate(count as usize);
    }
    smaller.controllers = scenario.controllers.iter().filter_map(|it| it.among_first(count)).collect();
    smaller.fault = scenario.fault.iter().map(|fault| fault.among_first(count)).collect::<Option<_>>()?;
    Some(smaller)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use scenario::{
        FaultKind,
        fault::{Kind, Parts},
    };

    use super::*;

    fn least(count: u32, shows: impl Fn(u32) -> bool) -> u32 {
        fewest(count, |robots| Ok::<_, Infallible>(shows(robots))).unwrap()
    }

    #[test]
    fn robots_are_taken_away_until_one_less_is_too_few() {
        for count in 1..60 {
            for needed in 1..=count {
                assert_eq!(least(count, |robots| robots >= needed), needed, "{needed} of {count}");
            }
        }
        let odd = least(50, |robots| robots % 2 == 0);
        assert_eq!(odd % 2, 0, "what does not hold is not taken");
    }

    #[test]
    fn nobody_asks_about_no_robots() {
        assert_eq!(least(50, |robots| robots > 0), 1);
    }

    fn scenario(extra: &str) -> Scenario {
        let text = format!(
            "duration_s = 10.0\nstep_s = 0.1\narena = {{ size_m = [2, 2] }}\ncontroller = {{ gain_per_s = 1.0 }}\n\
             channel = {{ range_m = 1.0 }}\n[robots]\ncount = 4\n{extra}"
        );
        Scenario::parse("x.toml", &text, &[]).unwrap()
    }

    #[test]
    fn named_robots_are_cut_to_those_that_remain() {
        let scenario = scenario(
            "positions_m = [[0.1, 0.1], [0.5, 0.5], [1, 1], [1.5, 1.5]]\nheadings_rad = [0, 1, 2, 3]\n\
             [[fault]]\nkind = \"pause\"\nrobots = \"1-3\"\n\
             [[fault]]\nkind = \"partition\"\ngroups = [\"0\", \"1,3\", \"2\"]\n\
             [[fault]]\nkind = \"loss\"\nprobability = 1\nlinks = [\"0->1\", \"0<->3\"]\n",
        );
        let smaller = with_robots(&scenario, 2).unwrap();
        assert_eq!(smaller.robot_count(), 2);
        let robots = smaller.fault[0].target.choice().unwrap().robots.as_ref();
        assert_eq!(robots.unwrap().to_string(), "1");
        let Kind::Partition(partition) = &smaller.fault[1].kind else { panic!("{:?}", smaller.fault[1]) };
        let Parts::Groups(groups) = &partition.parts else { panic!("{partition:?}") };
        assert_eq!(groups.iter().map(ToString::to_string).collect::<Vec<_>>(), ["0", "1"]);
        let links: Vec<String> = smaller.fault[2].target.links().iter().map(ToString::to_string).collect();
        assert_eq!(links, ["0->1"]);
        assert_eq!(smaller.fault.iter().map(|fault| fault.kind.kind()).next(), Some(FaultKind::Pause));
        Scenario::parse("x.toml", &smaller.to_toml(), &[]).unwrap();
        assert!(with_robots(&scenario, 1).is_none(), "the pause would strike nobody");
        assert!(with_robots(&scenario, 0).is_none());
    }

    #[test]
    fn a_lie_needs_the_robot_whose_name_is_taken() {
        let scenario = scenario("[[fault]]\nkind = \"liar\"\nrobots = 0\nidentity = 3\n");
        assert!(with_robots(&scenario, 4).is_some());
        assert!(with_robots(&scenario, 3).is_none());
    }
}
