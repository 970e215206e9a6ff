//! A file of shared memory seen as a value.
//!
//! Contract:
//! - A [`Shareable`] type consists of atomics alone, so that every bit pattern is a valid value,
//!   and a value may change under us at any moment by another process's hand.
//! - The mapping stays valid while the file keeps its length. Files live in a run's directory,
//!   are written once at their full length and never truncated; removing one leaves its memory
//!   to those who have mapped it.

#![allow(unsafe_code)]

use std::{
    fs::{File, OpenOptions},
    io,
    marker::PhantomData,
    ops::Deref,
    path::Path,
    ptr::NonNull,
    sync::atomic::{AtomicU32, AtomicU64},
};

use rustix::mm::{MapFlags, ProtFlags, mmap, munmap};

/// Types that may live in shared memory.
///
/// # Safety
/// The type must consist of atomics only: no padding that is read, no pointers, no niches. Every
/// bit pattern must be a valid value, zero being the initial one.
pub unsafe trait Shareable: Sync {}

// SAFETY: a single atomic is valid for every bit pattern.
unsafe impl Shareable for AtomicU32 {}
// SAFETY: as above.
unsafe impl Shareable for AtomicU64 {}
// SAFETY: an array of atomics consists of atomics only.
unsafe impl<T: Shareable, const N: usize> Shareable for [T; N] {}

/// A `T` in a file that other processes map too.
#[derive(Debug)]
pub struct Mapping<T: Shareable> {
    start: NonNull<T>,
    owns: PhantomData<T>,
}

// SAFETY: the mapping is plain memory, not tied to a thread; `T: Sync` allows use from any.
unsafe impl<T: Shareable> Send for Mapping<T> {}
// SAFETY: only shared references to `T` are handed out, and `T: Sync`.
unsafe impl<T: Shareable> Sync for Mapping<T> {}

impl<T: Shareable> Mapping<T> {
    /// Makes a file of zeros at `path`, which must not exist, and maps it.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).create_new(true).open(path)?;
        // Allocate now: on a full tmpfs this is an error here and not a SIGBUS later.
        rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, size_of::<T>() as u64)?;
        Self::map(&file)
    }

    /// Maps a file that another process has created.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().read(true).write(true).open(path)?;
        let length = file.metadata()?.len();
        if length != size_of::<T>() as u64 {
            let expected = size_of::<T>();
            let message = format!("{} holds {length} bytes, not {expected}", path.display());
            return Err(io::Error::new(io::ErrorKind::InvalidData, message));
        }
        Self::map(&file)
    }

    fn map(file: &File) -> io::Result<Self> {
        let flags = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: a fresh mapping at an address of the kernel's choice aliases nothing of ours.
        // The file is as long as `T` (checked by both callers), and a page start is aligned for it.
        let start = unsafe { mmap(std::ptr::null_mut(), size_of::<T>(), flags.0, flags.1, file, 0)? };
        let start = NonNull::new(start.cast()).expect("mmap reports failure by an error, not by null");
        Ok(Self { start, owns: PhantomData })
    }
}

impl<T: Shareable> Deref for Mapping<T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: `start` maps `size_of::<T>()` bytes until `drop`, and any bytes are a valid `T`.
        unsafe { self.start.as_ref() }
    }
}

impl<T: Shareable> Drop for Mapping<T> {
    fn drop(&mut self) {
        // SAFETY: `start` and the length are those of `map`, and no reference outlives `self`.
        // A failure would leave the memory mapped, which harms nobody.
        let _ = unsafe { munmap(self.start.as_ptr().cast(), size_of::<T>()) };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;

    #[test]
    fn what_one_mapping_writes_another_reads() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        let ours = Mapping::<[AtomicU64; 4]>::create(&path).unwrap();
        let theirs = Mapping::<[AtomicU64; 4]>::open(&path).unwrap();
        assert_eq!(theirs[3].load(Ordering::Relaxed), 0);
        ours[3].store(42, Ordering::Relaxed);
        assert_eq!(theirs[3].load(Ordering::Relaxed), 42);
    }

    #[test]
    fn a_removed_file_stays_mapped() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        let ours = Mapping::<AtomicU32>::create(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        ours.store(7, Ordering::Relaxed);
        assert_eq!(ours.load(Ordering::Relaxed), 7);
    }

    #[test]
    fn a_file_of_another_length_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        std::fs::write(&path, [0; 3]).unwrap();
        let error = Mapping::<AtomicU32>::open(&path).unwrap_err();
        assert!(ToString::to_string(&error).contains("holds 3 bytes, not 4"));
    }

    #[test]
    fn an_existing_file_is_not_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("page");
        let _first = Mapping::<AtomicU32>::create(&path).unwrap();
        assert_eq!(Mapping::<AtomicU32>::create(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }
}
