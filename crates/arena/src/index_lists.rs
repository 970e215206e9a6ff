//! One list of indices for each robot (or cell of a grid), all of them in one piece of memory.

use std::ops::{Index, Range};

/// Lists of indices.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct IndexLists {
    /// Where each list begins in `members`; one more entry than lists.
    starts: Vec<usize>,
    members: Vec<usize>,
}

impl IndexLists {
    /// Groups `entries` of the form (list, member) into `count` lists; members keep their order.
    pub fn grouped(count: usize, entries: &[(usize, usize)]) -> Self {
        let mut lists = Self::default();
        lists.regroup(count, entries);
        lists
    }

    /// Becomes what [`IndexLists::grouped`] gives, in the memory there is.
    pub fn regroup(&mut self, count: usize, entries: &[(usize, usize)]) {
        let Self { starts, members } = self;
        // Counted two places too far, `starts[list + 1]` is where `list` begins, and after the last
        // member where it ends.
        starts.clear();
        starts.resize(count + 2, 0);
        for (list, _) in entries {
            starts[list + 2] += 1;
        }
        for list in 2..count + 2 {
            starts[list] += starts[list - 1];
        }
        members.resize(entries.len(), 0);
        for &(list, member) in entries {
            members[starts[list + 1]] = member;
            starts[list + 1] += 1;
        }
        starts.pop();
    }

    /// The lists, in order.
    pub fn iter(&self) -> impl Iterator<Item = &[usize]> {
        self.starts.windows(2).map(|ends| &self.members[ends[0]..ends[1]])
    }

    /// Successive lists as one.
    pub fn joined(&self, lists: Range<usize>) -> &[usize] {
        &self.members[self.starts[lists.start]..self.starts[lists.end]]
    }
}

impl Index<usize> for IndexLists {
    type Output = [usize];

    fn index(&self, list: usize) -> &[usize] {
        self.joined(list..list + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_keep_their_order_and_lists_may_be_empty() {
        let lists = IndexLists::grouped(4, &[(2, 9), (0, 5), (2, 7), (2, 8)]);
        let each: Vec<&[usize]> = lists.iter().collect();
        assert_eq!(each, [&[5][..], &[], &[9, 7, 8], &[]]);
        assert_eq!(lists[2], [9, 7, 8]);
        assert_eq!(lists.joined(0..3), [5, 9, 7, 8]);
        let mut again = lists.clone();
        again.regroup(2, &[(1, 3)]);
        assert_eq!(again, IndexLists::grouped(2, &[(1, 3)]));
    }

    #[test]
    fn of_nobody_there_are_no_lists() {
        assert_eq!(IndexLists::grouped(0, &[]).iter().count(), 0);
    }
}
