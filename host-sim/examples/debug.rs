use agv_host_sim::{evaluate::{warehouse::*, accuracy::*}, simulate::{simulate, scenario::PathKind}, mapping::*, replay::replay};
use agv_core::{localizer::*, landmarks::*};
fn main(){
  let seed=1; let map=Map::Static; let path=PathKind::P1;
  let s=simulate(&scenario(path,map,seed)).unwrap(); let mut r=s.recording;
  r.parameters.maps=MapUse{reflectors:false,features:true,dynamic:false};
  let m=simulate(&scenario(PathKind::Mapping,map,seed)).unwrap().recording;
  let lm=map_features(&m,&Clustering::default()).unwrap(); println!("{} landmarks",lm.len());
  r.landmarks.extend(lm);
  let rep=replay(&r,|_|{}).unwrap();
  let mut last=Mode::NotLocalised;
  for p in &rep.poses { if p.mode!=last {println!("{:?} {:?} {:?} acc {:.2} nis {:.2} err {:?}",p.time.seconds(),p.mode,p.reason,p.acceptance,p.normalised_square,pose_error(p,&r.truth).map(|e|(e.position,e.heading.to_degrees())));last=p.mode;} }
  for u in rep.uses.iter().take(60) {println!("{:.3} {:?} {:?} {:?} {:?} {:?} {:.2}",u.time.seconds(),u.kind,u.landmark,u.verdict,u.position,u.residual,u.test_ratio);}
}
