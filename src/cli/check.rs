//! `relievo check JOB.toml`: reads and checks everything, writes nothing.
