//! What is optimized, how, and whether the shield filters it.

use super::super::flight::Legs;
use super::super::objective::Objective;
use super::Compiler;
use sidestep_collectives::{Choice, Estimator, Order, Settings, Stop, Update};
use sidestep_kernel::InputError;
use toml::Spanned;

/// Most samples of a block.
const MOST_SAMPLES: usize = 10_000;

impl Compiler<'_> {
    pub(super) fn objective(&self, vertical_m: f64) -> Result<Objective, InputError> {
        let section = &self.file.airspace;
        let paper = self.is_paper();
        let beta = self.positive(section.beta.as_ref(), 0.995)?;
        if beta > 1.0 {
            let span = section.beta.as_ref().map(Spanned::span);
            return Err(self.error(span, format!("beta = {beta}"), "give at most 1"));
        }
        Ok(Objective {
            alpha: self.positive(section.alpha.as_ref(), if paper { 1.0 } else { 0.001 })?,
            beta,
            inflation: self.positive(section.inflation.as_ref(), if paper { 1.0 } else { 1.12 })?,
            mask: true,
            vertical_m,
        })
    }

    pub(super) fn settings(&self) -> Result<Settings, InputError> {
        let section = &self.file.airspace;
        let paper = self.is_paper();
        let estimator =
            if paper { Estimator::Sampled { block: 20, ageing: 0.7 } } else { Estimator::Exact };
        let preset = if paper { 0.8 } else { 0.7 };
        let cooling = self.positive(section.cooling.as_ref(), preset)?;
        if cooling > 1.0 {
            let span = section.cooling.as_ref().map(Spanned::span);
            return Err(self.error(span, format!("cooling = {cooling}"), "give at most 1"));
        }
        let choice = if paper { Choice::Draw } else { Choice::Argmax };
        let order = if paper { Order::Parallel } else { Order::Sequence };
        Ok(Settings {
            estimator: self.estimator()?.unwrap_or(estimator),
            update: self.update()?.unwrap_or(Update::NearestNewton { step: 0.5 }),
            order: section.order.unwrap_or(order),
            utility: section.utility.unwrap_or_default(),
            cooling,
            stop: Stop {
                threshold: 1e-3,
                calm_rounds: 3,
                max_rounds: self.max_rounds()?.unwrap_or(200),
            },
            choice: section.choice.unwrap_or(choice),
        })
    }

    pub(super) fn has_shield(&self) -> Result<bool, InputError> {
        let Some(given) = &self.file.airspace.shield else { return Ok(true) };
        match given.get_ref().as_str() {
            Some("on") => Ok(true),
            Some("off") => Ok(false),
            _ => {
                let cause = format!("shield = {}", given.get_ref());
                Err(self.error(Some(given.span()), cause, "give \"on\" or \"off\""))
            }
        }
    }

    fn estimator(&self) -> Result<Option<Estimator>, InputError> {
        let Some(given) = &self.file.airspace.estimator else { return Ok(None) };
        if let Estimator::Sampled { block, ageing } = *given.get_ref()
            && !((1..=MOST_SAMPLES).contains(&block) && (0.0..=1.0).contains(&ageing))
        {
            let cause = format!("an estimator with block = {block}, ageing = {ageing}");
            let remedy = format!("give a block of 1 to {MOST_SAMPLES} samples, ageing from 0 to 1");
            return Err(self.error(Some(given.span()), cause, remedy));
        }
        Ok(Some(*given.get_ref()))
    }

    fn update(&self) -> Result<Option<Update>, InputError> {
        let Some(given) = &self.file.airspace.update else { return Ok(None) };
        let (Update::NearestNewton { step } | Update::Brouwer { step }) = *given.get_ref();
        if step > 0.0 && step <= 1.0 {
            return Ok(Some(*given.get_ref()));
        }
        let cause = format!("an update with step = {step}");
        Err(self.error(Some(given.span()), cause, "give a step above 0 and at most 1"))
    }

    fn max_rounds(&self) -> Result<Option<u32>, InputError> {
        match &self.file.airspace.max_rounds {
            Some(given) if *given.get_ref() == 0 => {
                Err(self.error(Some(given.span()), "max_rounds = 0", "give 1 or more"))
            }
            given => Ok(given.as_ref().map(|rounds| *rounds.get_ref())),
        }
    }

    pub(super) fn legs(&self) -> Result<Legs, InputError> {
        let legs = match &self.file.airspace.legs {
            Some(legs) => legs.clone(),
            None if self.is_paper() => Legs::default(),
            None => Legs::usual(),
        };
        self.times(&legs.turns_s, "legs.turns_s")?;
        self.times(&legs.until_s, "legs.until_s")?;
        Ok(legs)
    }

    pub(super) fn times(&self, times_s: &[f64], key: &str) -> Result<Vec<f64>, InputError> {
        if times_s.iter().any(|t| !(*t > 0.0 && t.is_finite())) || times_s.len() > 20 {
            let cause = format!("{key} = {times_s:?}");
            return Err(self.error(None, cause, "give up to 20 positive times in seconds"));
        }
        Ok(times_s.to_vec())
    }
}
