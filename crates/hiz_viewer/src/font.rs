//! A font of 5x7 pixels for the line of numbers, drawn on the host.

/// Pixels of a glyph, and from glyph to glyph.
const SIZE: [usize; 2] = [5, 7];
const ADVANCE: [usize; 2] = [6, 9];

/// Each glyph as seven rows of five pixels.
const GLYPHS: [(char, &str); 48] = [
    ('A', ".###. #...# #...# ##### #...# #...# #...#"),
    ('B', "####. #...# #...# ####. #...# #...# ####."),
    ('C', ".###. #...# #.... #.... #.... #...# .###."),
    ('D', "####. #...# #...# #...# #...# #...# ####."),
    ('E', "##### #.... #.... ####. #.... #.... #####"),
    ('F', "##### #.... #.... ####. #.... #.... #...."),
    ('G', ".###. #...# #.... #.### #...# #...# .####"),
    ('H', "#...# #...# #...# ##### #...# #...# #...#"),
    ('I', ".###. ..#.. ..#.. ..#.. ..#.. ..#.. .###."),
    ('J', "..### ...#. ...#. ...#. ...#. #..#. .##.."),
    ('K', "#...# #..#. #.#.. ##... #.#.. #..#. #...#"),
    ('L', "#.... #.... #.... #.... #.... #.... #####"),
    ('M', "#...# ##.## #.#.# #.#.# #...# #...# #...#"),
    ('N', "#...# ##..# ##..# #.#.# #..## #..## #...#"),
    ('O', ".###. #...# #...# #...# #...# #...# .###."),
    ('P', "####. #...# #...# ####. #.... #.... #...."),
    ('Q', ".###. #...# #...# #...# #.#.# #..#. .##.#"),
    ('R', "####. #...# #...# ####. #.#.. #..#. #...#"),
    ('S', ".#### #.... #.... .###. ....# ....# ####."),
    ('T', "##### ..#.. ..#.. ..#.. ..#.. ..#.. ..#.."),
    ('U', "#...# #...# #...# #...# #...# #...# .###."),
    ('V', "#...# #...# #...# #...# #...# .#.#. ..#.."),
    ('W', "#...# #...# #...# #.#.# #.#.# #.#.# .#.#."),
    ('X', "#...# #...# .#.#. ..#.. .#.#. #...# #...#"),
    ('Y', "#...# #...# .#.#. ..#.. ..#.. ..#.. ..#.."),
    ('Z', "##### ....# ...#. ..#.. .#... #.... #####"),
    ('0', ".###. #...# #..## #.#.# ##..# #...# .###."),
    ('1', "..#.. .##.. ..#.. ..#.. ..#.. ..#.. .###."),
    ('2', ".###. #...# ....# ...#. ..#.. .#... #####"),
    ('3', "##### ...#. ..#.. ...#. ....# #...# .###."),
    ('4', "...#. ..##. .#.#. #..#. ##### ...#. ...#."),
    ('5', "##### #.... ####. ....# ....# #...# .###."),
    ('6', "..##. .#... #.... ####. #...# #...# .###."),
    ('7', "##### ....# ...#. ..#.. .#... .#... .#..."),
    ('8', ".###. #...# #...# .###. #...# #...# .###."),
    ('9', ".###. #...# #...# .#### ....# ...#. .##.."),
    ('.', "..... ..... ..... ..... ..... .##.. .##.."),
    (',', "..... ..... ..... ..... .##.. ..#.. .#..."),
    (':', "..... .##.. .##.. ..... .##.. .##.. ....."),
    ('+', "..... ..#.. ..#.. ##### ..#.. ..#.. ....."),
    ('-', "..... ..... ..... ##### ..... ..... ....."),
    ('/', "..... ....# ...#. ..#.. .#... #.... ....."),
    ('%', "##... ##..# ...#. ..#.. .#... #..## ...##"),
    ('(', "...#. ..#.. .#... .#... .#... ..#.. ...#."),
    (')', ".#... ..#.. ...#. ...#. ...#. ..#.. .#..."),
    ('=', "..... ..... ##### ..... ##### ..... ....."),
    ('>', ".#... ..#.. ...#. ....# ...#. ..#.. .#..."),
    (' ', "..... ..... ..... ..... ..... ..... ....."),
];

/// Lines of text as an RGBA picture on a dark ground.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Sheet {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) rgba: Vec<u8>,
}

/// Draws lines of text; a character without a glyph is left out, and small letters are capital.
pub(crate) fn draw(lines: &[String]) -> Sheet {
    let columns = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    let [width, height] = [columns * ADVANCE[0] + 3, lines.len() * ADVANCE[1] + 2];
    let mut rgba = [12, 14, 18, 255].repeat(width * height);
    for (row, line) in lines.iter().enumerate() {
        for (column, wanted) in line.to_uppercase().chars().enumerate() {
            let Some((_, glyph)) = GLYPHS.iter().find(|(c, _)| *c == wanted) else { continue };
            for (place, pixel) in glyph.bytes().filter(|b| *b != b' ').enumerate() {
                if pixel == b'#' {
                    let x = 2 + column * ADVANCE[0] + place % SIZE[0];
                    let y = 2 + row * ADVANCE[1] + place / SIZE[0];
                    rgba[4 * (y * width + x)..][..4].copy_from_slice(&[235, 238, 242, 255]);
                }
            }
        }
    }
    Sheet { width: width as u32, height: height as u32, rgba }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_glyph_has_seven_rows_of_five() {
        for (glyph, rows) in GLYPHS {
            let rows: Vec<_> = rows.split(' ').collect();
            assert_eq!(rows.len(), SIZE[1], "{glyph:?}");
            assert!(rows.iter().all(|row| row.len() == SIZE[0]), "{glyph:?}");
        }
        let different: std::collections::HashSet<_> = GLYPHS.iter().map(|(_, rows)| rows).collect();
        assert_eq!(different.len(), GLYPHS.len());
    }

    #[test]
    fn text_lies_where_it_is_told() {
        let sheet = draw(&["-".into()]);
        let lit: Vec<_> = (0..sheet.width * sheet.height)
            .filter(|i| sheet.rgba[4 * *i as usize] > 200)
            .map(|i| (i % sheet.width, i / sheet.width))
            .collect();
        // The fourth row of the glyph, from column 2 on.
        assert_eq!(lit, [(2, 5), (3, 5), (4, 5), (5, 5), (6, 5)]);
    }
}
