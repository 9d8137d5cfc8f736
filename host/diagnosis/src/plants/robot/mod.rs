//! Robot: every axis under the load of gravity and of the other axes.

pub mod block;
mod links;
