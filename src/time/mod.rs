//! Run times: what is measured of them, and what is predicted.

pub mod model;
