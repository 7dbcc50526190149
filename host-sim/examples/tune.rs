use agv_core::features::falko::Parameters;
use agv_host_sim::evaluate::falko::Set;
use agv_host_sim::evaluate::places::*;
use agv_core::places::*;
use rayon::prelude::*;
fn knob(name: &str, default: f32) -> f32 { std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default) }
fn main() {
    let mut args = std::env::args().skip(1);
    let set = match args.next().as_deref() { Some("intel") => Set::Intel, _ => Set::Fr079 };
    let method = match args.next().as_deref() { Some("graph") => Method::GlarotGraph, Some("hough") => Method::GlarotHough, _ => Method::Improved };
    let n: usize = 10;
    let mut scans = set.scans().unwrap();
    if knob("CARMEN", 0.0) > 0.5 { scans = agv_host_sim::import::carmen::read(&agv_host_sim::data::folder().unwrap().join("scans2d/").join(std::env::var("LOG").unwrap())).unwrap().front.scans; }
    let mut p = Parameters::thesis();
    if method == Method::Improved {
        p.end_points = Parameters::mended().end_points;
        if let Some(e) = &mut p.end_points { e.depth = knob("DEPTH", 0.2); e.shortest = knob("SHORT", 0.3); e.points = knob("EPTS", 6.0) as u16; e.spacing = knob("SPACING", 0.1); e.residual = knob("ERES", 0.03); e.length=knob("ELEN",0.6); }
        if knob("JUMPS", 1.0) > 0.5 { p.jump = Some(knob("JUMP", 0.3)); }
        p.points_a_side = knob("SIDE", 2.0) as u16;
    }
    let described = DescribedScan::all(&scans, p);
    println!("kp/scan {}", described.iter().map(|d| d.keypoints.len()).sum::<usize>() as f64 / described.len() as f64);
    let tables = tables();
    let mut index = Box::new(PlaceIndex::<8192>::new());
    let start = std::time::Instant::now();
    for d in &described { index.push(Glare::of(&d.positions(), &tables)); }
    println!("signature us {}", start.elapsed().as_secs_f64() * 1e6 / described.len() as f64);
    for (protocol, mode) in [(Protocol::Thesis, Mode::Offline), (Protocol::Thesis, Mode::Online), (Protocol::Honest, Mode::Offline), (Protocol::Honest, Mode::Online)] {
        let start = std::time::Instant::now();
        let answers: Vec<(Option<Judged>, bool, bool)> = (0..described.len()).into_par_iter().map_init(Memory::default, |memory, q| {
            let counts = protocol.counts(mode, &described, q);
            let mut found = heapless::Vec::<Candidate, 10>::new();
            index.search(&index.signatures()[q], |c| protocol.admits(mode, &described, q, c as usize), &mut found);
            let mut best: Option<(usize, agv_core::geometry::Pose, usize, f64)> = None;
            let mut any = false;
            for c in found.iter().take(n) {
                if let Some((pose, points, score)) = associate(memory, method, &described[q], &described[c.place as usize]) {
                    any |= is_right(&described, q, c.place as usize, &pose);
                    if best.is_none_or(|b| score > b.3) { best = Some((c.place as usize, pose, points, score)); }
                }
            }
            (best.map(|(place, pose, points, score)| Judged { score, points, is_right: is_right(&described, q, place, &pose), counts }), counts, any)
        }).collect();
        let questions = answers.iter().filter(|a| a.1).count();
        let ceiling = answers.iter().filter(|a| a.1 && a.2).count() as f64 / questions as f64;
        let judged: Vec<Judged> = answers.iter().filter_map(|a| a.0).collect();
        let thr = knob("THR", 0.5) as f64;
        let f = figures(&judged, questions, |j| j.points >= 5 && (method != Method::Improved || j.score >= thr));
        let f0 = figures(&judged, questions, |j| method != Method::Improved || j.score >= thr);
        println!("{protocol:?} {mode:?}: N5 P {:.3} R {:.3}  thr-only P {:.3} R {:.3} | r95 {:.3} r99 {:.3} f1 {:.3} ceiling {:.3} q {} t {:.2}", f.precision, f.recall, f0.precision, f0.recall, f.r95, f.r99, f.max_f1, ceiling, questions, start.elapsed().as_secs_f64());
        for p in [0.95, 0.98, 0.99, 0.995] { let best = f.curve.iter().filter(|c| c.precision >= p).max_by(|a,b| a.recall.total_cmp(&b.recall)); if let Some(b) = best { print!("  thr@{p} {:.3} r {:.3};", b.threshold, b.recall); } }
        println!();
    }
}
