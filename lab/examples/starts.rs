use agv_lab::evaluate::contour_worlds::{SiteKind, run};
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let starts: u64 = args[1].parse().unwrap();
    let seed: u64 = args[2].parse().unwrap();
    for kind in SiteKind::ALL {
        if !kind.name().contains(args.get(3).map_or("", |t| t)) { continue; }
        for moved in [0.0, 0.3] {
            let o = run(kind, moved, seed, starts, || {});
            println!("{} {} starts {} right {} wrong {} ambiguous {} (fits {}) unknown {} effort {:.2}M {:.2}M", o.world, o.moved_share, o.starts, o.right, o.wrong, o.ambiguous, o.two_fit, o.unknown, o.effort.0/1e6, o.effort.1 as f64/1e6);
            for w in o.wrong_seeds.iter().take(5) { println!("  W {w}"); }
            for w in o.why.iter().take(args.get(4).map_or(3, |t| t.parse().unwrap())) { println!("  ? {w:.700}"); }
        }
    }
}
