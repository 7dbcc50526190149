//! Reports: one self-contained HTML page with pictures.

mod charts;
mod figure;
mod heat_map;
mod kinds;
mod page;
mod pdf;
pub mod scan_picture;
mod stanford_diagram;
mod state_timeline;
mod thinning;
mod trajectories;

pub use charts::{Bounds, LandmarkMark, landmark_timeline, line_chart, scatter_chart};
pub use figure::{Figure, FigureError, PointSet, Series};
pub use heat_map::{Cell, HeatMap, LineSet, heat_map};
pub use kinds::{FIT_TO_DOCK, FIT_TO_TRAVEL, NO_POSE, NOT_FIT};
pub use page::{Page, Table};
pub use pdf::{PdfError, write_pdf};
pub use stanford_diagram::{StanfordDiagram, stanford_diagram};
pub use state_timeline::{StateSpan, state_timeline};
pub use trajectories::{Map, trajectory_plot};
