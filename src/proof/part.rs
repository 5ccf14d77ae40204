//! A program as read, for one cutter.

use crate::gcode::read::{EventKind, Program};
use crate::job::CutterSpec;

/// What one cutter does: a program, or the part of one between two changes of the cutter.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name for messages: the file's, with the tool where there are several.
    pub name: String,
    /// The cutter.
    pub cutter: CutterSpec,
    /// Its moves and events; the lines are those of the whole program, `lines` is the part's last one.
    pub program: Program,
    /// Lines of the program that belong to the parts before it.
    pub lines_before: u32,
    /// False when a part before it already set the height.
    pub opens: bool,
    /// False when a part after it goes on, so that this one need not end the program.
    pub closes: bool,
}

impl Part {
    /// A program for one cutter.
    pub fn whole(name: &str, cutter: &CutterSpec, program: Program) -> Self {
        Self {
            name: name.to_owned(),
            cutter: cutter.clone(),
            program,
            lines_before: 0,
            opens: true,
            closes: true,
        }
    }

    /// The parts of a program, one for each cutter that it takes in turn. `cutter_of` knows the cutter of a tool number,
    /// and the one that is in the spindle before any is called (`None`). A tool that is called and never moved is left
    /// out; an empty spindle (tool 0) counts as the cutter before it, which is the safe way to take its moves.
    ///
    /// # Errors
    /// That of `cutter_of`.
    pub fn split<E>(
        name: &str,
        program: Program,
        mut cutter_of: impl FnMut(Option<u32>) -> Result<CutterSpec, E>,
    ) -> Result<Vec<Self>, E> {
        let changes = changes(&program);
        if let [(_, _, tool)] = changes[..] {
            return Ok(vec![Self::whole(name, &cutter_of(tool)?, program)]);
        }
        let mut parts = Vec::new();
        for (k, &(first, line, tool)) in changes.iter().enumerate() {
            let next = changes.get(k + 1);
            let (end, last_line) =
                next.map_or((program.moves.len(), program.lines), |n| (n.0, n.1 - 1));
            let opens = k == 0;
            let own = |line_of: u32| (opens || line_of >= line) && line_of <= last_line;
            let events = program.events.iter().filter(|e| own(e.line)).map(|e| {
                let at_move = e.at_move.clamp(first, end) - first;
                crate::gcode::read::Event { at_move, ..*e }
            });
            parts.push(Self {
                name: tool.map_or_else(|| name.to_owned(), |t| format!("{name} T{t}")),
                cutter: cutter_of(tool)?,
                program: Program {
                    moves: program.moves[first..end].to_vec(),
                    events: events.collect(),
                    lines: last_line,
                    blind_line: program.blind_line.filter(|_| opens),
                    first_z: program.first_z.filter(|_| opens),
                    notes: Vec::new(),
                    guessed: program.guessed.each_ref().map(|ranges| {
                        let own = ranges.iter().map(|r| r.start.max(first)..r.end.min(end));
                        own.filter(|r| r.start < r.end)
                            .map(|r| r.start - first..r.end - first)
                            .collect()
                    }),
                    ..program
                },
                lines_before: if opens { 0 } else { line - 1 },
                opens,
                closes: next.is_none(),
            });
        }
        Ok(parts)
    }
}

/// Where each cutter begins: its first move, the line that calls it, its number. Never empty.
fn changes(program: &Program) -> Vec<(usize, u32, Option<u32>)> {
    let mut changes: Vec<(usize, u32, Option<u32>)> = vec![(0, 1, None)];
    for e in &program.events {
        let EventKind::Tool { number } = e.kind else { continue };
        let last = changes.last_mut().expect("there is the first one");
        if number == 0 || last.2 == Some(number) {
            continue;
        }
        // One that has not moved yet gives way.
        if last.0 == e.at_move {
            last.2 = Some(number);
            if last.0 > 0 {
                last.1 = e.line;
            }
        } else {
            changes.push((e.at_move, e.line, Some(number)));
        }
    }
    if changes.len() > 1 && changes.last().is_some_and(|last| last.0 == program.moves.len()) {
        changes.pop();
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gcode::read::{Frame, read_any};
    use crate::geom::DVec3;
    use crate::job::Library;

    /// The parts of a program as (tool, first line, last line, moves, events).
    fn split(text: &str) -> Vec<(Option<u32>, u32, u32, usize, usize)> {
        let library = Library::built_in();
        let machine = library.machine("shapeoko3").unwrap();
        let frame = Frame::new(DVec3::new(0.0, 0.0, 10.0));
        let program = read_any(text.as_bytes(), machine, &frame).unwrap();
        let all = (program.moves.len(), program.events.len());
        let mut asked = Vec::new();
        let cutter = library.cutter("flat-6").unwrap().clone();
        let parts = Part::split("x", program, |tool| {
            asked.push(tool);
            Ok::<_, ()>(cutter.clone())
        })
        .unwrap();
        let sums = parts
            .iter()
            .fold((0, 0), |s, p| (s.0 + p.program.moves.len(), s.1 + p.program.events.len()));
        assert_eq!(sums, all, "nothing is lost or doubled");
        for (k, p) in parts.iter().enumerate() {
            assert_eq!((p.opens, p.closes), (k == 0, k + 1 == parts.len()));
            assert!(p.program.events.iter().all(|e| e.at_move <= p.program.moves.len()));
            assert!(p.program.moves.iter().all(|m| m.line > p.lines_before));
        }
        let told = parts.iter().zip(asked);
        told.map(|(p, tool)| {
            let program = &p.program;
            (tool, p.lines_before + 1, program.lines, program.moves.len(), program.events.len())
        })
        .collect()
    }

    #[test]
    fn a_program_of_one_cutter_is_one_part() {
        assert_eq!(split("G0 Z5\nM3 S9000\nG0 X1\nM30"), [(None, 1, 4, 2, 2)]);
        assert_eq!(split("T2 M6\nG0 Z5\nM3 S9000\nG0 X1\nM30"), [(Some(2), 1, 5, 2, 3)]);
        assert_eq!(split(""), [(None, 1, 0, 0, 0)]);
    }

    #[test]
    fn every_cutter_gets_its_moves() {
        let text = "T1 M6\nG0 Z5\nM3 S9000\nG0 X1\nM5\nT2 M6\nM3 S8000\nG0 X2\nG0 X3\nM30";
        // M6 and M3 and M5; M6, M3 and M30.
        assert_eq!(split(text), [(Some(1), 1, 5, 2, 3), (Some(2), 6, 10, 2, 3)]);
    }

    #[test]
    fn a_cutter_called_twice_or_never_used_makes_no_part() {
        let text =
            "G0 Z5\nT1 M6\nG0 X1\nT1 M6\nG0 X2\nT3 M6\nT4 M6\nG0 X3\nT0 M6\nG0 X4\nT9 M6\nM30";
        let parts = split(text);
        let tools: Vec<_> = parts.iter().map(|p| (p.0, p.3)).collect();
        assert_eq!(tools, [(None, 1), (Some(1), 2), (Some(4), 2)]);
    }
}
