//! Optimisers: what each owes its users, how good they are, and swarms of thousands; the problems that they are compared on.

mod contract;
mod large_swarms;
mod many_objectives;
mod minimise;
mod optimisers;
mod scales;
mod suites;
