//! Pictures show what they are given.

use agv_host_sim::report::{
    Bounds, LandmarkMark, Map, PointSet, Series, landmark_timeline, line_chart, scatter_chart, trajectory_plot,
};

/// Colour of the first series.
const FIRST: &str = "#0072B2";

/// The points of each line in that colour, pixels.
fn lines(svg: &str, colour: &str) -> Vec<Vec<(f64, f64)>> {
    let polylines = svg.split("<polyline").skip(1).filter(|line| line.split("/>").next().unwrap().contains(colour));
    let points = polylines.map(|line| line.split("points=\"").nth(1).unwrap().split('"').next().unwrap());
    let parse = |point: &str| {
        let (x, y) = point.split_once(',').unwrap();
        (x.parse().unwrap(), y.parse().unwrap())
    };
    points.map(|points| points.split_whitespace().map(parse).collect()).collect()
}

fn extent(points: &[(f64, f64)]) -> [f64; 2] {
    let width = |values: &dyn Fn(&(f64, f64)) -> f64| {
        points.iter().map(values).fold(f64::NEG_INFINITY, f64::max)
            - points.iter().map(values).fold(f64::INFINITY, f64::min)
    };
    [width(&|point| point.0), width(&|point| point.1)]
}

#[test]
fn both_axes_of_a_map_have_one_scale() {
    // Narrow, square and wide worlds; the path is a square in each.
    for (width, height) in [(4.0, 100.0), (10.0, 10.0), (100.0, 4.0)] {
        let corners = [(0.0, 0.0), (width, height)];
        let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0), (0.0, 0.0)];
        let landmarks = [PointSet { name: "corners", points: &corners }];
        let map = Map { outlines: &[[(0.0, 0.0), (1.0, 1.0)]], landmarks: &landmarks };
        let figure = trajectory_plot(&map, &[Series { name: "path", points: &square }]).unwrap();
        let [x, y] = extent(&lines(figure.svg(), FIRST)[0]);
        assert!(x > 10.0 && (x - y).abs() <= 2.0, "{width} x {height}: {x} by {y} pixels");
    }
}

#[test]
fn a_gap_interrupts_the_line_and_up_is_up() {
    let points = [(0.0, 0.0), (1.0, 1.0), (2.0, f64::NAN), (3.0, 1.0), (4.0, 3.0)];
    let figure = line_chart(["s, m", "error, mm"], &[Series { name: "a", points: &points }], None).unwrap();
    let lines = lines(figure.svg(), FIRST);
    assert_eq!(lines.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
    assert!(lines[0][0].1 > lines[0][1].1 && lines[0][0].0 < lines[0][1].0);
    assert!(figure.svg().contains("s, m") && figure.svg().contains("error, mm"));
}

#[test]
fn bounds_are_always_in_the_picture() {
    let bounds = Bounds { name: "limit", heights: &[20.0] };
    let series = Series { name: "a", points: &[(0.0, 0.0), (1.0, 1.0)] };
    let figure = line_chart(["s, m", "error, mm"], &[series], Some(bounds)).unwrap();
    let [_, height] = extent(&lines(figure.svg(), FIRST)[0]);
    assert!(height > 1.0 && height < 40.0, "the line takes a twentieth of the height, not {height} pixels");
}

#[test]
fn every_mark_is_drawn_once() {
    let marks: Vec<_> = (0..30)
        .map(|index| LandmarkMark { x: f64::from(index), landmark: index % 7, is_accepted: index % 3 > 0 })
        .collect();
    let figure = landmark_timeline("time, s", &marks).unwrap();
    assert_eq!(figure.svg().matches("<circle").count(), 20);
    let points = [(0.0, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0), (2.0, 2.0)];
    let figure = scatter_chart(["time, s", "residual"], &[PointSet { name: "a", points: &points }], None).unwrap();
    assert_eq!(figure.svg().matches("<circle").count(), 2);
}

#[test]
fn nothing_and_nonsense_can_be_drawn() {
    let nonsense = [(f64::NAN, f64::INFINITY), (f64::NEG_INFINITY, 0.0)];
    for points in [&[][..], &nonsense, &[(1e300, -1e300)], &[(5.0, 5.0)]] {
        let series = [Series { name: "a", points }];
        line_chart(["x", "y"], &series, None).unwrap();
        scatter_chart(["x", "y"], &[PointSet { name: "a", points }], None).unwrap();
        trajectory_plot(&Map::default(), &series).unwrap();
    }
    landmark_timeline("x", &[]).unwrap();
}
