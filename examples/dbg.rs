use relievo::*;
fn main(){
 let a: Vec<String> = std::env::args().collect();
 let lib = job::Library::built_in();
 let text = std::fs::read_to_string(&a[1]).unwrap();
 let draft = job::Draft::from_toml(&text,"x.toml",&lib,&|_|Err(std::io::ErrorKind::NotFound.into())).unwrap();
 let f = std::path::Path::new(&a[1]).parent().unwrap().join(&draft.artwork().file);
 let art = artwork::read_svg(&std::fs::read(f).unwrap(), &artwork::Fonts::none()).unwrap();
 let c = carve(draft,&art,&mut |_|{}).unwrap();
 for p in &c.programs { std::fs::write(format!("/tmp/dbg-{}",p.name),&p.text).unwrap(); }
 for f in &c.verdict.failures { println!("{f:?}"); }
}
