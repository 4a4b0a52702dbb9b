//! Optimisers: what each owes its users, how good they are, and swarms of thousands; the problems that they are compared on.

mod large_swarms;
mod optimisers;
mod suites;
