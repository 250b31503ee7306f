use super::output;
use crate::Result;
use asperity_contact::method::{MethodCard, Quantity, Support};
use asperity_methods::REGISTRY;

#[derive(Debug, clap::Args)]
pub(super) struct MethodsArgs {
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
    /// Print the table as Markdown, as in docs/methods.md.
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

/// Why a quantity is not delivered in full.
fn reason(support: Support) -> Option<String> {
    match support {
        Support::Full => None,
        Support::NoAdhesion => Some("not delivered with adhesion".into()),
        Support::Only(terms) => Some(format!("limited: {terms}")),
        Support::No(reason) => Some(format!("not delivered: {reason}")),
    }
}

fn push_new<'a>(list: &mut Vec<&'a str>, name: &'a str) {
    if !list.contains(&name) {
        list.push(name);
    }
}

impl MethodsArgs {
    pub(super) fn execute(self) -> Result<()> {
        let cards: Vec<_> = REGISTRY.iter().map(|m| m.card()).collect();
        if self.json {
            return output::json_line(&serde_json::json!({ "methods": cards }));
        }
        if self.markdown {
            output::print(&markdown(&cards));
            return Ok(());
        }
        output::print(&output::table(
            &["id", "in the paper", "family", "contact criterion", "what it does"],
            cards.iter().map(|c| {
                vec![c.id.into(), c.paper_name.into(), c.family.into(), c.criterion.to_string(), c.summary.into()]
            }),
        ));
        // Below the table, once per reason: a column of reasons would be wider than a screen.
        let mut limits: Vec<(String, Vec<&str>, Vec<&str>)> = Vec::new();
        for card in &cards {
            for quantity in Quantity::OUTPUTS {
                let Some(reason) = reason((card.supports)(quantity)) else { continue };
                let known = limits.iter().position(|l| l.0 == reason).unwrap_or_else(|| {
                    limits.push((reason, Vec::new(), Vec::new()));
                    limits.len() - 1
                });
                let (_, quantities, ids) = &mut limits[known];
                push_new(quantities, quantity.name());
                push_new(ids, card.id);
            }
        }
        for (reason, quantities, ids) in limits {
            output::print(&format!("{}: {}: {reason}", ids.join(", "), quantities.join(", ")));
        }
        for (card, errors) in cards.iter().filter_map(|c| Some((c, c.measured_errors?))) {
            output::print(&format!("{}: measured errors: {errors}", card.id));
        }
        Ok(())
    }
}

/// Cards as a table of Markdown; a star marks constants that were fitted.
fn markdown(cards: &[&MethodCard]) -> String {
    let line = |c: &&MethodCard| {
        let (fitted, name) = (if c.calibrated_on.is_some() { "*" } else { "" }, c.paper_name);
        let name = if name == "-" { "–" } else { name };
        format!("| `{}`{fitted} | {name} | {} | {} | {} |", c.id, c.family, c.criterion, c.summary)
    };
    let head = ["| id | in the paper | family | contact criterion | what it does |", "|---|---|---|---|---|"]
        .map(String::from);
    head.into_iter().chain(cards.iter().map(line)).collect::<Vec<_>>().join("\n")
}
