//! Recordings, layouts and clouds as the programs of others write them: the right values, or a word of what is wrong.

mod can_logs;
mod carmen;
mod corpus;
mod layouts;
mod support;
