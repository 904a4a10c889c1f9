//! Pictures of runs, as arrays of pixels.

use crate::error::{self, argument_error};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use sidestep::kernel::Simulation;
use sidestep::kernel::view::{AgentNumber, FrameOptions};
use sidestep_draw::{
    AnimationFrame, AnimationLook, AnimationRenderer, AnimationSize, DrawError, PictureView,
    TrailChoice,
};
use std::sync::{Mutex, PoisonError};

/// Draws runs of one scenario. The renderer is kept, with its look, since it draws the scenery once for all pictures.
#[derive(Default)]
pub(crate) struct Pictures(Mutex<Option<(AnimationLook, AnimationRenderer)>>);

impl Pictures {
    /// Draws the present state of a run; also returns the size in pixels.
    pub(crate) fn draw(
        &self,
        simulation: &mut dyn Simulation,
        look: AnimationLook,
    ) -> PyResult<(AnimationFrame, (u32, u32))> {
        let frame = simulation.frame(FrameOptions::WITHOUT_SCANS);
        let scenery = simulation.scenery();
        AgentNumber::check_all(&look.trails.agents, &scenery, &frame.bodies)
            .map_err(|e| argument_error("agents", e.cause(), e.remedy()))?;
        // Without a floor the view is that of the present state, which a kept renderer has not.
        let is_kept = scenery.floor.is_some();
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let renderer = match kept.take() {
            Some((kept_look, renderer)) if is_kept && kept_look == look => renderer,
            _ => AnimationRenderer::new(scenery, std::slice::from_ref(&frame), &look)
                .map_err(|e| look_error(&e, look.size))?,
        };
        let caption = format!("cycle {}", frame.cycle);
        let still = renderer.render(&frame, &[], &caption).map_err(|e| draw_error(&e))?;
        let size = renderer.size_px();
        *kept = Some((look, renderer));
        Ok((still, size))
    }
}

/// Returns a picture as an array (height, width, 3) of red, green and blue.
pub(crate) fn to_pixels<'py>(
    py: Python<'py>,
    still: &AnimationFrame,
    (width, height): (u32, u32),
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let opaque = still.rgba().chunks_exact(4).flat_map(|pixel| &pixel[..3]);
    let pixels: Vec<u8> = opaque.copied().collect();
    PyArray1::from_vec(py, pixels).reshape([height as usize, width as usize, 3])
}

/// Returns the look of a picture from the arguments of `render`.
pub(crate) fn parse_look(
    width: u32,
    size: Option<[u32; 2]>,
    agents: Vec<u32>,
    view: Option<&str>,
) -> PyResult<AnimationLook> {
    let view = match view.map(str::parse::<PictureView>) {
        None => PictureView::Usual,
        Some(Ok(view)) => view,
        Some(Err(cause)) => {
            let remedy = "give \"top\", \"side\", \"front\" or angles, like \"-60,30\"";
            return Err(argument_error("view", cause, remedy));
        }
    };
    let agents = agents.into_iter().map(|number| AgentNumber { number, part: None }).collect();
    let trails = TrailChoice { agents, from: None };
    Ok(AnimationLook {
        size: size.map_or(AnimationSize::LongerSide(width), AnimationSize::Exact),
        trails,
        view,
    })
}

/// Returns the error of a picture that cannot be drawn, with the argument that is wrong.
fn look_error(error: &DrawError, size: AnimationSize) -> PyErr {
    match error {
        DrawError::FlatView(_) => {
            argument_error("view", error.to_string(), "give \"top\", or leave it out")
        }
        _ if matches!(size, AnimationSize::Exact(_)) => {
            let remedy =
                "give a width and a height of at most 4096 pixels, with room for the line of text";
            argument_error("size", error.to_string(), remedy)
        }
        _ => argument_error("width", error.to_string(), "give 1 to 4096 pixels"),
    }
}

pub(crate) fn draw_error(error: &DrawError) -> PyErr {
    error::RecordError::new_err(error.to_string())
}
