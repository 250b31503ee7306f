use super::words;
use crate::Result;
use crate::method::{Quantity, REGISTRY, Support};

#[derive(Debug, clap::Args)]
pub struct Methods {
    /// One line of JSON on stdout.
    #[arg(long)]
    json: bool,
}

impl Methods {
    pub fn execute(self) -> Result<()> {
        let cards: Vec<_> = REGISTRY.iter().map(|m| m.card()).collect();
        if self.json {
            return words::json_line(&serde_json::json!({ "methods": cards }));
        }
        words::say(&words::table(
            &["id", "in the paper", "family", "contact is", "what it does", "does not deliver"],
            cards.iter().map(|c| {
                let lacking: Vec<String> = Quantity::ALL
                    .iter()
                    .filter_map(|q| match (c.supports)(*q) {
                        Support::Full => None,
                        Support::NoAdhesion => Some(format!("{} with adhesion", q.name())),
                        Support::Only(terms) => Some(format!("{} (only {terms})", q.name())),
                        Support::No(reason) => Some(format!("{} ({reason})", q.name())),
                    })
                    .collect();
                let lacking = if lacking.is_empty() { "-".into() } else { lacking.join(", ") };
                vec![
                    c.id.into(),
                    c.paper_name.into(),
                    c.family.into(),
                    c.criterion.to_string(),
                    c.summary.into(),
                    lacking,
                ]
            }),
        ));
        Ok(())
    }
}
