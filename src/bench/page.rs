//! A report as one HTML file that needs no other: text, tables, plots and pictures.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222;\
background:#fff}h1{font-size:1.6em}h2{margin-top:2em;border-bottom:1px solid #ccc}table{border-collapse:collapse;\
margin:1em 0;font-size:13px;font-variant-numeric:tabular-nums}th,td{padding:3px 9px;border-bottom:1px solid #ddd;\
text-align:right}th:first-child,td:first-child{text-align:left}th{background:#f4f4f4}figure{margin:1em 0;display:\
inline-block;vertical-align:top;max-width:100%}figcaption{font-size:12px;color:#555;max-width:720px}img{max-width:100%}\
.picture{width:calc(50% - 15px);margin:4px;cursor:zoom-in}.picture:focus{width:100%;cursor:zoom-out}.picture img{width:100%}\
svg{max-width:100%;height:auto}.scroll{overflow-x:auto}code{background:#f4f4f4;padding:1px 4px}";

const JPEG_QUALITY: u8 = 85;

/// See the module.
pub struct Page {
    title: String,
    body: String,
}

/// Text for HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

impl Page {
    /// An empty page.
    pub fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            body: format!("<h1>{}</h1>\n", escaped(title)),
        }
    }

    fn add(&mut self, arguments: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(arguments);
    }

    /// Begins a part.
    pub fn heading(&mut self, text: &str) {
        self.add(format_args!("<h2>{}</h2>\n", escaped(text)));
    }

    /// Begins a part of a part.
    pub fn subheading(&mut self, text: &str) {
        self.add(format_args!("<h3>{}</h3>\n", escaped(text)));
    }

    /// Text.
    pub fn paragraph(&mut self, text: &str) {
        self.add(format_args!("<p>{}</p>\n", escaped(text)));
    }

    /// A table; the first column holds names.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| {
            row.map(|c| format!("<{tag}>{}</{tag}>", escaped(c)))
                .collect::<String>()
        };
        let top = cells("th", &mut head.iter().copied());
        let body: String = rows
            .iter()
            .map(|r| format!("<tr>{}</tr>\n", cells("td", &mut r.iter().map(String::as_str))))
            .collect();
        self.add(format_args!(
            "<div class=\"scroll\"><table><tr>{top}</tr>\n{body}</table></div>\n"
        ));
    }

    /// A plot with a caption that says where its numbers stand.
    pub fn plot(&mut self, svg: &str, caption: &str) {
        self.add(format_args!(
            "<figure>{svg}<figcaption>{}</figcaption></figure>\n",
            escaped(caption)
        ));
    }

    /// A picture with a caption, of 8-bit sRGB: as JPEG, because noise makes large PNGs; the files beside the page are exact.
    /// Two stand side by side; one that is clicked takes the page's whole width.
    pub fn picture(&mut self, width: u32, height: u32, pixels: &[[u8; 3]], caption: &str) {
        let mut bytes = Vec::new();
        let encoded = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode(
            pixels.as_flattened(),
            width,
            height,
            image::ExtendedColorType::Rgb8,
        );
        let caption = escaped(caption);
        match encoded {
            Ok(()) => {
                let data = BASE64_STANDARD.encode(&bytes);
                self.add(format_args!(
                    "<figure class=\"picture\" tabindex=\"0\" title=\"click for full width\">\
                     <img alt=\"{caption}\" src=\"data:image/jpeg;base64,{data}\">\
                     <figcaption>{caption}</figcaption></figure>\n"
                ));
            }
            Err(e) => self.paragraph(&format!("The picture {caption} cannot be shown: {e}.")),
        }
    }

    /// The file.
    pub fn html(&self) -> String {
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width\"><title>{}</title><style>{STYLE}</style></head>\n\
             <body>\n{}</body></html>\n",
            escaped(&self.title),
            self.body
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_no_markup() {
        let mut page = Page::new("a<b");
        page.table(&["x"], &[vec!["<script>".into()]]);
        page.picture(1, 1, &[[255, 0, 0]], "\"c\"");
        let html = page.html();
        assert!(
            !html.contains("<script>")
                && html.contains("<title>a&lt;b</title>")
                && html.contains("image/jpeg;base64,/9j/")
        );
    }
}
