//! Recordings as bags of ROS 2, which `ros2 bag`, RViz, PlotJuggler and others read.
//!
//! In:  messages of a recording in their order ([`Export::add`]).
//! Out: the storage file of a bag, MCAP with messages in CDR, and the text of its `metadata.yaml` ([`Bag`]).
//!
//! A bag is a folder with these two files; whoever calls makes it. Bags have version 8 of rosbag2's format: ROS 2 Humble and
//! all later distributions read it, while Humble cannot read the version 9 that Jazzy writes.

#![forbid(unsafe_code)]

mod cdr;
mod definitions;
mod export;
mod messages;
mod metadata;
mod metrics;
mod poses;
mod scene;
mod topic;
mod writer;

pub use crate::{
    export::{Export, ExportError},
    writer::{Bag, WriteError},
};
