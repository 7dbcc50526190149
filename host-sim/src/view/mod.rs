//! Looking at a drive: one page in a browser, served on loopback, of a log or of a controller that drives.

mod feed;
mod happening;
mod hits;
mod moment;
mod overview;
mod path;
mod scans;
mod server;
mod timeline;

pub use feed::{FeedError, follow, load};
pub use happening::{Happening, HappeningKind};
pub use moment::Moment;
pub use overview::Overview;
pub use path::{Outline, Window};
pub(crate) use server::serve_router;
pub use server::{Shared, serve};
pub use timeline::{Status, Timeline};
