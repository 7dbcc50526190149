//! What it costs to localise in a kept map of contours, and to find a start in it.

use agv_core::contours::{KeptMap, Submap};
use agv_core::localizer::{
    CONTOUR_SLICE, ContourStartFinder, Event, LentCapacities, Localizer, MapUse, Parameters, StartState,
};
use agv_core::sources::Places;
use agv_firmware::board::an500::host_file::HostFile;
use agv_firmware::board::an500::stopwatch::Stopwatch;
use static_cell::{ConstStaticCell, StaticCell};

use crate::{Count, count_scan, init};

type Finder = ContourStartFinder<Places<'static, 400, 6144>>;

static BYTES: ConstStaticCell<[u8; 128 * 1024]> = ConstStaticCell::new([0; 128 * 1024]);
static KEPT: StaticCell<Localizer<LentCapacities>> = StaticCell::new();
static FINDER: StaticCell<Finder> = StaticCell::new();
static ROOM: StaticCell<Submap<6144>> = StaticCell::new();

/// A vehicle in a kept map, and one beside it that searches its start there over and over.
pub struct Contours {
    map: KeptMap<'static>,
    kept: &'static mut Localizer<LentCapacities<'static>>,
    finder: &'static mut Finder,
    room: &'static mut Submap<6144>,
    /// Instructions of the search that is under way.
    sum: u64,
    scan: Count,
    slice: Count,
    search: Count,
}

impl Contours {
    /// Both, in the map `contours.map` of the emulating machine's folder.
    pub fn new(parameters: &Parameters) -> Self {
        let mut file = HostFile::open(c"contours.map").expect("contours.map is in the folder");
        let bytes = BYTES.take();
        let count = file.read(bytes).expect("the map can be read");
        let bytes: &'static [u8] = &bytes[..count];
        let mut parameters = *parameters;
        parameters.maps = MapUse { reflectors: false, features: false, dynamic: false, slam: false };
        let kept = init(&KEPT, || Localizer::new(parameters));
        kept.lend_contours(bytes).expect("it is a map of contours");
        Self {
            map: KeptMap::read(bytes).expect("it is a map of contours"),
            kept,
            finder: init(&FINDER, || ContourStartFinder::new(parameters)),
            room: ROOM.init_with(Submap::new),
            sum: 0,
            scan: Count::new("scan cycle in a kept map of contours"),
            slice: Count::new("a slice of a search among contours"),
            search: Count::new("a search among contours"),
        }
    }

    /// Takes an event of the drive.
    pub fn handle(&mut self, stopwatch: &Stopwatch, event: &Event) {
        count_scan(stopwatch, &mut self.scan, self.kept, event);
        self.finder.handle(event);
        if !matches!(event, Event::Scan(_)) {
            return;
        }
        let mut state = StartState::Searching;
        while state == StartState::Searching {
            let slice = stopwatch.count(|| state = self.finder.search(&self.map, self.room, CONTOUR_SLICE));
            self.slice.add(slice);
            self.sum += slice;
        }
        self.search.add(self.sum);
        self.sum = 0;
    }

    /// What was counted.
    pub fn counts(self) -> [Count; 3] {
        [self.scan, self.slice, self.search]
    }
}
