//! Layouts of reflectors as drawings and tables of others.

use std::fmt::Write;

use agv_host_sim::layout_file;
use nalgebra::Complex;
use proptest::prelude::*;

use super::support::Ended;
use crate::support::Files;

/// A drawing of those entities, with blocks and layers before them.
fn drawing(units: Option<u8>, layers: &str, blocks: &str, entities: &str) -> String {
    let units = units.map_or(String::new(), |units| format!("9\n$INSUNITS\n70\n{units}\n"));
    let layers = if layers.is_empty() {
        String::new()
    } else {
        format!("0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n1\n{layers}0\nENDTAB\n0\nENDSEC\n")
    };
    format!(
        "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n{units}0\nENDSEC\n{layers}0\nSECTION\n2\nBLOCKS\n{blocks}0\nENDSEC\n\
         0\nSECTION\n2\nENTITIES\n{entities}0\nENDSEC\n0\nEOF\n"
    )
}

fn block(name: &str, base: [f64; 2], entities: &str) -> String {
    format!("0\nBLOCK\n8\n0\n2\n{name}\n70\n0\n10\n{}\n20\n{}\n30\n0\n{entities}0\nENDBLK\n8\n0\n", base[0], base[1])
}

fn at([x, y]: [f64; 2]) -> String {
    format!("10\n{x}\n20\n{y}\n30\n0\n")
}

fn point(place: [f64; 2], rest: &str) -> String {
    format!("0\nPOINT\n8\nR\n{}{rest}", at(place))
}

fn circle(place: [f64; 2], rest: &str) -> String {
    format!("0\nCIRCLE\n8\nR\n{}40\n50\n{rest}", at(place))
}

fn insert(name: &str, place: [f64; 2], rest: &str) -> String {
    format!("0\nINSERT\n8\nR\n2\n{name}\n{}{rest}", at(place))
}

fn text(place: [f64; 2], value: &str) -> String {
    format!("0\nTEXT\n8\nR\n{}40\n200\n1\n{value}\n", at(place))
}

fn converted(name: &str, content: &[u8], options: &[&str]) -> (Ended, Vec<(u16, i32, i32)>) {
    let files = Files::new();
    let (input, output) = (files.write(name, content), files.path("out.imk"));
    let ended = Ended::of(&[&["layout", "convert", &input, &output], options].concat());
    let places = if ended.code == Some(0) {
        let layout = layout_file::load(output.as_ref()).unwrap();
        layout.iter().map(|entry| (entry.id, entry.landmark.x.0, entry.landmark.y.0)).collect()
    } else {
        Vec::new()
    };
    (ended, places)
}

/// Of places whose names do not matter.
fn places(content: &str) -> Vec<(i32, i32)> {
    let (ended, places) = converted("d.dxf", content.as_bytes(), &[]);
    assert_eq!(ended.code, Some(0), "{ended:?}");
    let mut places: Vec<(i32, i32)> = places.iter().map(|(_, x, y)| (*x, *y)).collect();
    places.sort_unstable();
    places
}

/// From below, in which all x are mirrored.
const FROM_BELOW: &str = "210\n0\n220\n0\n230\n-1\n";

#[test]
fn what_a_drawing_shows_is_where_it_shows_it() {
    let symbol = block("S", [0.0, 0.0], &circle([0.0, 0.0], ""));
    let pair = block("PAIR", [100.0, 0.0], &(insert("S", [100.0, 0.0], "") + &insert("S", [1100.0, 0.0], "")));
    let blocks = symbol + &pair;
    for (case, entities, expected) in [
        ("points are in the world", point([-1000.0, 500.0], FROM_BELOW), vec![(-1000, 500)]),
        ("circles are in their own plane", circle([-1000.0, 500.0], FROM_BELOW), vec![(1000, 500)]),
        ("blocks are in their own plane", insert("S", [-1000.0, 500.0], FROM_BELOW), vec![(1000, 500)]),
        ("blocks in blocks", insert("PAIR", [2000.0, 3000.0], ""), vec![(2000, 3000), (3000, 3000)]),
        ("turned", insert("PAIR", [2000.0, 3000.0], "50\n90\n"), vec![(2000, 3000), (2000, 4000)]),
        ("scaled", insert("PAIR", [0.0, 0.0], "41\n2\n42\n2\n"), vec![(0, 0), (2000, 0)]),
        ("mirrored", insert("PAIR", [0.0, 0.0], "41\n-1\n42\n1\n"), vec![(-1000, 0), (0, 0)]),
        (
            "rows and columns",
            insert("S", [0.0, 0.0], "70\n2\n71\n3\n44\n1000\n45\n2000\n"),
            vec![(0, 0), (0, 2000), (0, 4000), (1000, 0), (1000, 2000), (1000, 4000)],
        ),
        ("paper", point([1.0, 2.0], "") + &point([9.0, 9.0], "67\n1\n"), vec![(1, 2)]),
        ("invisible", point([1.0, 2.0], "") + &point([9.0, 9.0], "60\n1\n"), vec![(1, 2)]),
    ] {
        assert_eq!(places(&drawing(Some(4), "", &blocks, &entities)), expected, "{case}");
    }
}

#[test]
fn layers_that_are_off_or_frozen_are_not_there() {
    let layer =
        |name: &str, flags: u8, colour: i8| format!("0\nLAYER\n2\n{name}\n70\n{flags}\n62\n{colour}\n6\nCONTINUOUS\n");
    let layers = layer("R", 0, 7) + &layer("OFF", 0, -7) + &layer("COLD", 1, 7) + &layer("DOOR", 0, 3);
    let on = |name: &str, x: f64| point([x, 0.0], "").replace("8\nR\n", &format!("8\n{name}\n"));
    let entities = on("R", 1000.0) + &on("OFF", 2000.0) + &on("COLD", 3000.0) + &on("DOOR", 4000.0);
    let content = drawing(Some(4), &layers, "", &entities);
    assert_eq!(places(&content), [(1000, 0), (4000, 0)]);
    let (ended, chosen) = converted("d.dxf", content.as_bytes(), &["--layer", "R"]);
    assert_eq!((ended.code, chosen.len()), (Some(0), 1));
    let (refused, _) = converted("d.dxf", content.as_bytes(), &["--layer", "NONE"]);
    assert!(refused.code == Some(1) && refused.complaint.contains("on the layer NONE"), "{refused:?}");
}

#[test]
fn names_are_texts_long_texts_and_attributes() {
    let symbol = block("S", [0.0, 0.0], &circle([0.0, 0.0], ""));
    let attribute =
        "66\n1\n0\nATTRIB\n8\nR\n10\n5100\n20\n5100\n30\n0\n40\n200\n1\n33\n2\nNR\n70\n0\n0\nSEQEND\n8\nR\n";
    let long = |place, value: &str| format!("0\nMTEXT\n8\nR\n{}40\n200\n41\n0\n71\n1\n1\n{value}\n", at(place));
    let entities = point([1000.0, 0.0], "")
        + &text([1000.0, 0.0], "17")
        + &point([2000.0, 0.0], "")
        + &long([2000.0, 0.0], "{\\fArial|b0|i0;\\C1;18}")
        + &insert("S", [5000.0, 5000.0], attribute);
    let (ended, mut found) = converted("d.dxf", drawing(Some(4), "", &symbol, &entities).as_bytes(), &[]);
    found.sort_unstable();
    assert_eq!(found, [(17, 1000, 0), (18, 2000, 0), (33, 5000, 5000)], "{ended:?}");
}

#[test]
fn units_are_stated_told_by_the_size_or_asked_for() {
    let entities = point([1.5, 2.0], "") + &point([14.7, -4.2], "");
    for (units, options, expected, warnings) in [
        (Some(6), &[][..], (1500, 2000), 0),
        (None, &[], (1500, 2000), 1),
        (Some(0), &[], (1500, 2000), 1),
        (Some(4), &[], (2, 2), 1),
        (None, &["--unit", "cm"], (15, 20), 0),
        (Some(2), &[], (457, 610), 0),
    ] {
        let (ended, found) = converted("d.dxf", drawing(units, "", "", &entities).as_bytes(), options);
        assert_eq!(
            (found[0].1, found[0].2, ended.warnings().len()),
            (expected.0, expected.1, warnings),
            "{units:?} {ended:?}"
        );
    }
    // A hall in millimetres without a unit is what it was.
    let (ended, found) =
        converted("d.dxf", drawing(None, "", "", &(point([0.0; 2], "") + &point([40_000.0, 0.0], ""))).as_bytes(), &[]);
    assert_eq!((found[1].1, ended.warnings().len()), (40_000, 0), "{ended:?}");
}

#[test]
fn coordinates_of_a_country_need_an_origin() {
    let entities = point([691_014.7, 5_333_995.8], "") + &point([691_000.0, 5_334_000.0], "");
    let content = drawing(Some(6), "", "", &entities);
    let (refused, _) = converted("d.dxf", content.as_bytes(), &[]);
    assert!(refused.code == Some(1) && refused.complaint.contains("--origin 691014,5333995"), "{refused:?}");
    let (ended, found) = converted("d.dxf", content.as_bytes(), &["--origin", "691000,5334000"]);
    assert_eq!(found.iter().map(|one| (one.1, one.2)).collect::<Vec<_>>(), [(14_700, -4200), (0, 0)], "{ended:?}");
}

#[test]
fn other_encodings_are_read_or_named() {
    let entities = point([1000.0, 0.0], "") + &text([9.0, 9.0], "Pr\u{fc}fung");
    let old: Vec<u8> = drawing(Some(4), "", "", &entities).chars().map(|one| one as u8).collect();
    let (ended, found) = converted("d.dxf", &old, &[]);
    assert_eq!((found.len(), ended.code), (1, Some(0)), "{ended:?}");
    let (refused, _) = converted("d.dxf", b"\x00\x01\x02\x03 something", &[]);
    assert!(refused.complaint.contains("not a drawing (DXF) but binary data"), "{refused:?}");
}

#[test]
fn tables_are_read_by_the_names_of_their_columns() {
    for (case, text) in [
        ("as this program writes it", "globID,x_mm,y_mm,type,subtype,size_mm,layers\n7,1500,-2250,1,2,80,0\n"),
        ("another order", "y_mm,x_mm,globID\n-2250,1500,7\n"),
        ("semicolons and decimal commas", "Nr;X [m];Y [m]\n7;1,5;-2,25\n"),
        ("tabulators", "id\tx (mm)\ty (mm)\n7\t1500\t-2250\n"),
        ("a stated separator", "sep=;\r\nname;x_m;y_m\r\n7;1.5;-2.25\r\n"),
        ("east and north", "Northing_m,Easting_m,Point\n-2.25,1.5,7\n"),
        ("a map", "id,kind,x_m,y_m,deviation_m\n7,reflector,1.500000,-2.250000,0.002000\n8,corner,0.0,0.0,0.01\n"),
    ] {
        let (ended, found) = converted("layout.csv", text.as_bytes(), &[]);
        assert_eq!(found, [(7, 1500, -2250)], "{case}: {ended:?}");
    }
    for (text, expected) in [
        ("globID,east_m\n7,1\n", "there is no column y among globID, east_m"),
        ("globID,x_mm,y_mm\n7,1,two\n", "layout.csv:2: y is no number: \"two\""),
        ("globID,x_mm,y_mm\nR7,1,2\n", "the name is no whole number from 0 to 65535: \"R7\""),
        ("globID,x_mm,y_mm\n7,1,2\n7,3,4\n", "layout.csv:3: the name was used before"),
        ("globID,x_m,y_m\n7,691014.7,5333995.8\n", "--origin 691014,5333995"),
    ] {
        let (refused, _) = converted("layout.csv", text.as_bytes(), &[]);
        assert!(refused.code == Some(1) && refused.complaint.contains(expected), "{expected}: {refused:?}");
    }
}

/// A block as it is put into another one.
#[derive(Clone, Debug)]
struct Inserted {
    base: [f64; 2],
    place: [f64; 2],
    degrees: f64,
    scale: f64,
    is_mirrored: bool,
    is_from_below: bool,
    /// Columns and rows, and the way from one to the next.
    grid: ([u16; 2], [f64; 2]),
}

impl Inserted {
    /// The group codes that say so.
    fn rest(&self) -> String {
        let Self { degrees, scale, grid: ([columns, rows], [along, up]), .. } = self;
        let across = if self.is_mirrored { -scale } else { *scale };
        let below = if self.is_from_below { FROM_BELOW } else { "" };
        format!(
            "41\n{across}\n42\n{scale}\n43\n{scale}\n50\n{degrees}\n70\n{columns}\n71\n{rows}\n44\n{along}\n45\n{up}\n{below}"
        )
    }

    fn copies(&self) -> Vec<[f64; 2]> {
        let ([columns, rows], [along, up]) = self.grid;
        let place = |column, row| [f64::from(column) * along, f64::from(row) * up];
        (0..columns).flat_map(|column| (0..rows).map(move |row| place(column, row))).collect()
    }

    /// Where a point of the block is then.
    fn put(&self, point: Complex<f64>, [along, up]: [f64; 2]) -> Complex<f64> {
        let inner = self.scale * (point - Complex::new(self.base[0], self.base[1]));
        let inner = if self.is_mirrored { -inner.conj() } else { inner };
        let turn = Complex::from_polar(1.0, self.degrees.to_radians());
        let put = Complex::new(self.place[0], self.place[1]) + turn * (inner + Complex::new(along, up));
        if self.is_from_below { -put.conj() } else { put }
    }
}

/// Somewhere in a hall, to the millimetre.
fn place() -> impl Strategy<Value = [f64; 2]> {
    [-20_000_i32..20_000, -20_000_i32..20_000].prop_map(|place| place.map(f64::from))
}

fn any_insert() -> impl Strategy<Value = Inserted> {
    let grid = ([1_u16..3, 1_u16..3], place());
    (place(), place(), 0..360_i32, prop::sample::select(vec![0.5, 1.0, 2.0]), any::<[bool; 2]>(), grid).prop_map(
        |(base, place, degrees, scale, [is_mirrored, is_from_below], grid)| Inserted {
            base,
            place,
            degrees: f64::from(degrees),
            scale,
            is_mirrored,
            is_from_below,
            grid,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn any_dialect_of_a_table_says_the_same(
        rows in prop::collection::btree_map(0_u16..60_000, (-900_000_i32..900_000, -900_000_i32..900_000), 1..30),
        separator in prop::sample::select(vec![',', ';', '\t']),
        order in Just(vec![0_usize, 1, 2]).prop_shuffle(),
        is_crlf in any::<bool>(),
        has_commas in any::<bool>(),
        in_metres in any::<bool>(),
    ) {
        let unit = if in_metres { "m" } else { "mm" };
        let names = ["id".to_owned(), format!("x_{unit}"), format!("y_{unit}")];
        let number = |value: i32| {
            let text = if in_metres { format!("{:.3}", f64::from(value) * 1e-3) } else { value.to_string() };
            if has_commas && separator != ',' { text.replace('.', ",") } else { text }
        };
        let line = |cells: [String; 3]| -> String {
            order.iter().map(|place| cells[*place].clone()).collect::<Vec<_>>().join(&separator.to_string())
        };
        let end = if is_crlf { "\r\n" } else { "\n" };
        let mut text = line(names) + end;
        for (id, (x, y)) in &rows {
            write!(text, "{}{end}", line([id.to_string(), number(*x), number(*y)])).unwrap();
        }
        let files = Files::new();
        let path = files.write("layout.csv", text.as_bytes());
        let layout = layout_file::load(path.as_ref()).unwrap();
        let found: Vec<_> = layout.iter().map(|entry| (entry.id, (entry.landmark.x.0, entry.landmark.y.0))).collect();
        prop_assert_eq!(found, rows.into_iter().collect::<Vec<_>>());
    }

    #[test]
    fn blocks_in_blocks_are_where_complex_numbers_say(
        inserted in prop::collection::vec(any_insert(), 1..4),
        points in prop::collection::vec(place(), 2..5),
    ) {
        let mut expected: Vec<Complex<f64>> = points.iter().map(|[x, y]| Complex::new(*x, *y)).collect();
        let mut content: String = points.iter().map(|place| point(*place, "")).collect();
        let mut blocks = String::new();
        for (level, one) in inserted.iter().enumerate() {
            let name = format!("B{level}");
            blocks += &block(&name, one.base, &content);
            content = insert(&name, one.place, &one.rest());
            expected = one.copies().into_iter().flat_map(|copy| expected.iter().map(move |point| one.put(*point, copy))).collect();
        }
        let found = places(&drawing(Some(4), "", &blocks, &content));
        // To the millimetre of a layout.
        let is_near = |(x, y): &(i32, i32)| {
            let found = Complex::new(f64::from(*x), f64::from(*y));
            expected.iter().any(|one| (one - found).norm() < 0.8)
        };
        prop_assert_eq!(found.len(), expected.len());
        prop_assert!(found.iter().all(is_near), "{:?} {:?}", found, expected);
    }

    #[test]
    fn no_text_is_too_much(text in "(?s).{0,300}", name in prop::sample::select(vec!["a.csv", "a.imk", "a.dxf"])) {
        let files = Files::new();
        let _ = layout_file::load(files.write(name, text.as_bytes()).as_ref());
    }
}

#[test]
fn what_the_reader_of_drawings_did_not_expect_is_no_fault_of_the_program() {
    let sound = drawing(Some(4), "", "", &point([1000.0, 2000.0], ""));
    let (ended, places) = converted("sound.dxf", sound.as_bytes(), &[]);
    assert_eq!((ended.code, places), (Some(0), vec![(0, 1000, 2000)]), "{}", ended.complaint);
    // Dates that no calendar has.
    for date in ["1e300", "-1e300", "9e15", "1e12"] {
        let content =
            sound.replacen("$ACADVER\n1\nAC1015\n", &format!("$ACADVER\n1\nAC1015\n9\n$TDCREATE\n40\n{date}\n"), 1);
        let (ended, places) = converted("date.dxf", content.as_bytes(), &[]);
        let is_read = ended.code == Some(0) && places == [(0, 1000, 2000)];
        let is_refused = ended.code == Some(1)
            && ended.complaint.lines().count() == 1
            && ended.complaint.contains("no drawing has")
            && !ended.complaint.contains("fault of the program");
        assert!(is_read || is_refused, "{date}: {}", ended.complaint);
    }
}
