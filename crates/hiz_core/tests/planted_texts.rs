//! Every text at which a test plants a fault occurs in a shader.
//! This includes ignored tests, Python's tests, and documents about them.
//! `Engine::with_planted_faults` panics at a text that no longer exists.
//! An ignored test would report that only when somebody runs it.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

/// As much of Rust's grammar as planted faults need.
#[derive(Debug, Clone, PartialEq)]
enum Token {
    Text(String),
    Word(String),
    Sign(char),
}

fn tokens(source: &str) -> Vec<Token> {
    let chars: Vec<char> = source.chars().collect();
    let (mut tokens, mut i) = (Vec::new(), 0);
    while i < chars.len() {
        match chars[i] {
            '/' if chars.get(i + 1) == Some(&'/') => {
                while i < chars.len() && chars[i] != '\n' {
                    i += 1;
                }
            }
            '"' => {
                let mut text = String::new();
                i += 1;
                while i < chars.len() && chars[i] != '"' {
                    if chars[i] != '\\' {
                        text.push(chars[i]);
                        i += 1;
                        continue;
                    }
                    match chars[i + 1] {
                        'n' => text.push('\n'),
                        // The text continues on the next line, after its indentation.
                        '\n' => {
                            while chars[i + 2].is_whitespace() {
                                i += 1;
                            }
                        }
                        other => text.push(other),
                    }
                    i += 2;
                }
                i += 1;
                tokens.push(Token::Text(text));
            }
            c if c.is_alphanumeric() || c == '_' => {
                let begin = i;
                while i < chars.len() && (chars[i].is_alphanumeric() || chars[i] == '_') {
                    i += 1;
                }
                tokens.push(Token::Word(chars[begin..i].iter().collect()));
            }
            // A character literal that is a quote would otherwise begin a text.
            '\'' if chars.get(i + 2) == Some(&'\'') => i += 3,
            c => {
                if !c.is_whitespace() {
                    tokens.push(Token::Sign(c));
                }
                i += 1;
            }
        }
    }
    tokens
}

/// The texts at which faults are planted.
/// A text is the first of two in `(what, by)` or `(what, by, ...)` that are not a call's arguments.
/// `what` may also be a name that the same file gives to a text.
fn planted(source: &str) -> Vec<String> {
    use Token::{Sign, Text, Word};
    let tokens = tokens(source);
    let mut names = HashMap::new();
    for i in 0..tokens.len() {
        let [Word(name), rest @ ..] = &tokens[i..] else { continue };
        let ([Sign('='), Text(value), Sign(';'), ..]
        | [Sign(':'), Sign('&'), Word(_), Sign('='), Text(value), Sign(';'), ..]) = rest
        else {
            continue;
        };
        names.insert(name.clone(), value.clone());
    }
    let mut found = Vec::new();
    for i in 1..tokens.len() {
        let is_call = matches!(tokens[i - 1], Word(_) | Sign('!'));
        let ([Sign('('), what, Sign(','), Text(_), Sign(',' | ')'), ..]
        | [Sign('('), what, Sign(','), Sign('&'), Word(_), Sign(',' | ')'), ..]) = &tokens[i..]
        else {
            continue;
        };
        match what {
            _ if is_call => {}
            Text(what) => found.push(what.clone()),
            Word(name) => found.extend(names.get(name).cloned()),
            Sign(_) => {}
        }
    }
    found
}

/// The texts of `HIZVK_PLANTED_FAULT='what => by'`, and of Python's `"what => by"`.
fn planted_by_variable(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in source.lines() {
        let Some((before, _)) = line.split_once(" => ") else { continue };
        let shell = before.split_once("HIZVK_PLANTED_FAULT='").map(|(_, what)| what);
        let what = shell.or_else(|| before.trim_start().strip_prefix('"'));
        found.extend(what.map(|what| what.replace("\\n", "\n").replace("\\\"", "\"")));
    }
    found
}

fn files(folder: &Path, ending: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.expect("a file").path();
        if path.is_dir() {
            files(&path, ending, found);
        } else if path.extension().is_some_and(|e| e == ending) {
            found.push(path);
        }
    }
}

fn read_all(folder: &Path, ending: &str) -> Vec<(PathBuf, String)> {
    let mut paths = Vec::new();
    files(folder, ending, &mut paths);
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("UTF-8");
            (path, text)
        })
        .collect()
}

#[test]
fn every_planted_text_stands_in_a_shader() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let shaders = read_all(&root.join("shaders"), "wgsl");
    let mut planted_at: Vec<(PathBuf, String)> = Vec::new();
    for (path, source) in read_all(&root.join("crates/hiz_core/tests"), "rs") {
        if source.contains("planted_faults(")
            && path.file_name().is_some_and(|name| name != "planted_texts.rs")
        {
            planted_at.extend(planted(&source).into_iter().map(|what| (path.clone(), what)));
        }
    }
    let in_rust = planted_at.len();
    let written = ["docs", "tests"].into_iter().zip(["md", "py"]).flat_map(|(folder, ending)| {
        let python = ending == "py";
        read_all(&root.join(folder), ending)
            .into_iter()
            .filter(move |(_, s)| !python || s.contains("PLANTED_FAULT"))
    });
    let contributing = root.join("CONTRIBUTING.md");
    let contributing =
        (contributing.clone(), fs::read_to_string(contributing).expect("CONTRIBUTING.md"));
    for (path, source) in written.chain([contributing]) {
        planted_at
            .extend(planted_by_variable(&source).into_iter().map(|what| (path.clone(), what)));
    }
    eprintln!("{} planted texts, {in_rust} of them in Rust", planted_at.len());
    assert!(in_rust > 80, "the search for planted texts is blind: {in_rust}");
    assert!(planted_at.len() > in_rust, "and blind to HIZVK_PLANTED_FAULT");
    let gone: Vec<_> = planted_at
        .iter()
        .filter(|(_, what)| !shaders.iter().any(|(_, shader)| shader.contains(what)))
        .collect();
    assert!(gone.is_empty(), "no shader says what faults are planted at: {gone:#?}");
}

#[test]
fn planted_texts_are_found_as_tests_write_them() {
    let source = r#"
        const WIDE: &str = "a wide text";
        let near = "select(min(a, b))";
        // ("a comment", "no fault")
        let faults = [("what", "by"), (near, "far"), (WIDE, ""), ("what \"more\"\nand \
            on", "by", MODES), ("a name", &[("inner", "by"), ("made", &by)])];
        text.replace("no", "fault"); assert!(("no fault" == "by"), "really");
    "#;
    let expected =
        ["what", "select(min(a, b))", "a wide text", "what \"more\"\nand on", "inner", "made"];
    assert_eq!(planted(source), expected);
    let shell = "  HIZVK_PLANTED_FAULT='a - 1u => a - 2u' cargo test\n    \
                 \"max(a, b) => min(a, b)\",\nnot this => that";
    assert_eq!(planted_by_variable(shell), ["a - 1u", "max(a, b)"]);
}
