//! Parts of all pages: the frame of a page, cards, numbers.

use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("report.css");

/// One self-contained HTML page.
pub struct Page<'a> {
    /// The title of the window.
    pub title: &'a str,
    /// The heading.
    pub heading: &'a str,
    /// The paragraph below the heading.
    pub introduction: Markup,
    /// Everything below.
    pub body: Markup,
    /// JavaScript that runs at the end, or nothing.
    pub script: &'a str,
}

impl Page<'_> {
    /// The text of the page.
    pub fn into_html(self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    main {
                        header { h1 { (self.heading) } p { (self.introduction) } }
                        (self.body)
                    }
                    @if !self.script.is_empty() {
                        script { (PreEscaped(self.script)) }
                    }
                }
            }
        };
        page.into_string()
    }
}

/// A number in large type with its name.
pub struct Card {
    /// The number, with its unit.
    pub value: Markup,
    /// The name of the number.
    pub name: String,
    /// Whether to show it as a failure.
    pub is_bad: bool,
}

impl Card {
    /// A card that is no failure.
    pub fn new(value: Markup, name: impl Into<String>) -> Self {
        Self { value, name: name.into(), is_bad: false }
    }
}

/// The cards, one after the other.
pub fn cards(cards: impl IntoIterator<Item = Card>) -> Markup {
    html! {
        @for card in cards {
            div class=(if card.is_bad { "card bad" } else { "card" }) { b { (card.value) } span { (card.name) } }
        }
    }
}

/// A number and its unit; "none" where there is no number.
pub fn number(value: Option<f64>, digits: usize, unit: &str) -> Markup {
    match value {
        Some(value) => with_unit(format!("{value:.digits$}"), unit),
        None => html! { "none" },
    }
}

/// A value and, in smaller type, its unit or "of so many".
pub fn with_unit(value: impl ToString, unit: &str) -> Markup {
    html! { (value.to_string()) small { (unit) } }
}

/// A plot with its caption.
pub fn figure(svg: String, caption: &str) -> Markup {
    html! { figure { (PreEscaped(svg)) figcaption { (caption) } } }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_escaped_and_plots_are_not() {
        let body = figure("<svg></svg>".into(), "errors < 1 m & \"right\"");
        let page = Page { title: "<b>", heading: "a & b", introduction: html! {}, body, script: "a < b" }.into_html();
        assert!(page.starts_with("<!DOCTYPE html>") && page.contains("<title>&lt;b&gt;</title><style>:root{"));
        assert!(page.contains("<h1>a &amp; b</h1>") && page.contains("<script>a < b</script>"));
        assert!(page.contains("<figure><svg></svg><figcaption>errors &lt; 1 m &amp; &quot;right&quot;</figcaption>"));
    }

    #[test]
    fn a_missing_number_is_none() {
        assert_eq!(number(None, 1, "m").into_string(), "none");
        assert_eq!(number(Some(1.25), 1, "m").into_string(), "1.2<small>m</small>");
    }
}
