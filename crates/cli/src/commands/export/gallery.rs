//! The runs of a sweep as a folder of pages.

use super::{ExportArgs, ExportFormat, check_format_options, export_scope};
use crate::console::{Console, group_thousands};
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::worlds;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep::kernel::shell::{shell_path, sidestep_command};
use sidestep_server::replay_page::InspectionRequest;
use sidestep_server::sweep_gallery::{
    GalleryContent, GalleryRequest, GalleryResult, export_gallery,
};
use sidestep_session::display_path;
use sidestep_session::sweep::Folder;

/// # Errors
/// When an option is wrong, or the pages cannot be made or stored.
pub(super) fn export_sweep(
    args: &ExportArgs,
    folder: &Folder,
    console: Console,
) -> Result<ExitCode, Failure> {
    check_options(args, folder)?;
    interrupt::listen()?;
    let request = GalleryRequest {
        scope: export_scope(args),
        inspections: InspectionRequest { agents: args.agents.clone(), cycles: args.cycles },
        runs: args.runs.unwrap_or_default(),
    };
    match export_gallery(worlds(), folder, &request, &ConsoleWatcher::new(console)) {
        Err(Failure::Interrupted) => Ok(ExitCode::Interrupted),
        result => {
            print_result(&result?, console)?;
            Ok(ExitCode::Done)
        }
    }
}

/// Refuses formats that are of one run, and options that have no effect on the runs of a sweep.
fn check_options(args: &ExportArgs, folder: &Folder) -> Result<(), InputError> {
    if args.to != ExportFormat::Page {
        let place = format!("--to {}", args.to.name());
        let remedy = format!(
            "give `--to page`; the table of its runs is {}, and `{}` writes its results",
            shell_path(folder.results_file()),
            sidestep_command("report", folder.path())
        );
        return Err(InputError::new(place, "this is a sweep, not a run", remedy));
    }
    let given = [
        ("--from", args.from.is_some()),
        ("--until", args.until.is_some()),
        ("--beside", args.beside.is_some()),
    ];
    for (option, is_given) in given {
        if is_given {
            let cause = "means nothing for the runs of a sweep, which are shown whole";
            return Err(InputError::new(option, cause, "leave it out"));
        }
    }
    check_format_options(args)
}

fn print_result(result: &GalleryResult, console: Console) -> Result<(), Failure> {
    let GalleryResult { index, content } = result;
    let json = json!({
        "written": [display_path(index)],
        "digest_confirmed": true,
        "gallery": {
            "runs": content.runs,
            "outliers": content.outliers,
            "replays": content.replays,
            "inspections": content.inspections,
            "events_left_out": content.events_left_out,
            "bytes": content.bytes,
        },
    });
    let names = format!("{}\n", index.display());
    console.print_result_or_short(&json, &names, || format!("{names}{}", text(content)))
}

/// Returns what the pages hold, and how to get more.
fn text(content: &GalleryContent) -> String {
    let count = |n: usize| group_thousands(n as u64);
    let GalleryContent { runs, outliers, replays, events_left_out, bytes, .. } = content;
    let all = if replays < runs { "; --runs all makes one of each" } else { "" };
    let lost = match events_left_out {
        0 => String::new(),
        lost => format!("  {} events are not in them: too many\n", group_thousands(*lost)),
    };
    format!(
        "  {} runs, {} of them outliers\n  {} replays, with the digests of the sweep{all}\n{lost}  {} bytes\n",
        count(*runs),
        count(*outliers),
        count(*replays),
        group_thousands(*bytes),
    )
}
