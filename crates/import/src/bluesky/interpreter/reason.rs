//! The names of commands, and the reasons why some have no effect here.

/// Commands to one aircraft; its identifier may precede them.
const AIRCRAFT_COMMANDS: [&str; 41] = [
    "ADDWPT",
    "AFTER",
    "ALT",
    "AT",
    "ATALT",
    "ATDIST",
    "ATSPD",
    "BANK",
    "BEFORE",
    "CALL",
    "CRZALT",
    "CRZSPD",
    "DEL",
    "DELETE",
    "DELRTE",
    "DELWPT",
    "DEST",
    "DIRECT",
    "DUMPRTE",
    "ENG",
    "HDG",
    "HEADING",
    "LISTRTE",
    "LNAV",
    "MOVE",
    "NOM",
    "ORIG",
    "PCALL",
    "POS",
    "RTA",
    "SETMASS",
    "SPD",
    "SPEED",
    "SWTOC",
    "SWTOD",
    "THR",
    "TURN",
    "VNAV",
    "VS",
    "WPTYPE",
    "ADDWAYPOINTS",
];

/// Commands beside those to an aircraft and those of a display.
const OTHER_COMMANDS: [&str; 23] = [
    "ASAS",
    "CDMETHOD",
    "CLRCRECMD",
    "CRE",
    "CREATE",
    "CRECMD",
    "CRECONFS",
    "DEFWPT",
    "DTLOOK",
    "NOISE",
    "NORESO",
    "PRIORULES",
    "QUIT",
    "RESET",
    "RESO",
    "RESOOFF",
    "RFACH",
    "RMETHH",
    "SCHEDULE",
    "SYN",
    "WIND",
    "ZONEDH",
    "ZONER",
];

/// Commands that change or query a display.
const DISPLAY_COMMANDS: [&str; 40] = [
    "ADDNODES",
    "AIRPORT",
    "AIRWAY",
    "AIRWAYS",
    "AWY",
    "BLUESKY",
    "CALC",
    "COL",
    "COLOR",
    "COLOUR",
    "DEBUG",
    "DISP",
    "DIST",
    "DOC",
    "ECHO",
    "FILTERALT",
    "GETWIND",
    "HELP",
    "INSEDIT",
    "LABEL",
    "LEGEND",
    "LINE",
    "LINES",
    "LISTRTE",
    "LSVAR",
    "MAGDEC",
    "MAGVAR",
    "PAN",
    "PLOT",
    "POLYLINE",
    "POLYLINES",
    "POS",
    "PRINT",
    "SSD",
    "SWRAD",
    "SYMBOL",
    "TRAIL",
    "TRAILS",
    "VIS",
    "ZOOM",
];

/// Returns the name of a command that other names stand for.
pub(super) fn canonical_name(name: &str) -> &str {
    match name {
        "CREATE" => "CRE",
        "DELETE" => "DEL",
        "WPTYPE" => "ADDWPT",
        "HEADING" | "TURN" => "HDG",
        "SPEED" => "SPD",
        "PZR" | "RPZ" | "PZRADIUS" => "ZONER",
        "PZDH" | "DHPZ" | "PZHEIGHT" => "ZONEDH",
        "RESOFACH" | "HRFAC" | "HRESOFAC" => "RFACH",
        "CALL" => "PCALL",
        "LOAD" | "OPEN" => "IC",
        "CLOSE" | "END" | "EXIT" | "Q" | "STOP" => "QUIT",
        other => other,
    }
}

/// Returns whether a command affects the display only: a name of the list, or zooming with `+` and `-`.
pub(super) fn is_display(name: &str) -> bool {
    let is_zoom = !name.is_empty() && name.chars().all(|c| "+-=".contains(c));
    is_zoom || DISPLAY_COMMANDS.contains(&name)
}

/// Returns whether a command is to one aircraft.
pub(super) fn is_aircraft_command(name: &str) -> bool {
    AIRCRAFT_COMMANDS.contains(&name)
}

/// Returns whether the first word is a command, not an aircraft.
pub(super) fn is_command(name: &str) -> bool {
    is_display(name) || is_aircraft_command(name) || OTHER_COMMANDS.contains(&name)
}

/// Returns the reason why a command has no effect.
pub(super) fn reason_without_effect(name: &str) -> &'static str {
    match name {
        "HOLD" | "PAUSE" => {
            "the simulator waits there for somebody to go on, and the run goes on at once"
        }
        "OP" | "START" | "RUN" | "CONTINUE" | "FF" | "FWD" | "FF_SNAP" | "DTMULT" | "RTF"
        | "RT" | "REALTIME" | "DT" | "FIXDT" | "BENCHMARK" | "SIMDT" | "NOSTOP" => {
            "it sets how fast or how finely the simulator computes"
        }
        "SCEN" | "SCENARIO" | "DATE" | "TIME" | "SEED" => {
            "a name, a date or a seed of the simulator, on which no flight depends here"
        }
        "MCRE" | "TRAFGEN" => "aircraft that the simulator draws at random",
        "BATCH" => "a list of scenarios; fly each of them by its own name",
        "ATALT" | "ATSPD" | "ATDIST" => "commands on a condition are not flown yet",
        "AREA" | "BOX" | "CIRCLE" | "POLY" | "POLYGON" | "POLYALT" | "GEOFENCE" | "GEOVECTOR"
        | "TAXI" => "areas have no effect here",
        "DATALOG" | "CRELOG" | "SNAPLOG" | "INSTLOG" | "SKYLOG" | "EVTLOG" | "FLSTLOG"
        | "CONFLOG" | "METRIC" | "SAVEIC" | "SAVE" => {
            "records of the simulator; a run has its own tables"
        }
        "CRZALT" | "CRZSPD" => "altitudes and speeds of a route are not flown yet",
        "DELWPT" | "DELRTE" | "DIRECT" | "MOVE" => {
            "changes of a route on the way are not flown yet"
        }
        "ADDWPTMODE" | "BANK" | "THR" | "ENG" | "SETMASS" | "PERF" | "NOM" | "SWTOC" | "SWTOD" => {
            "airplanes here have no type, and turn at 25 degrees of bank"
        }
        "GROUP" | "UNGROUP" => "groups of aircraft are not known here; name each aircraft",
        "RSZONER" | "RSZONEDH" | "RESOFACV" | "RESOZONER" | "RESOZONEDH" | "DTNOLOOK" => {
            "this setting of the resolution is not known here"
        }
        "ADSB" | "TREACT" | "DTREACT" => {
            "surveillance is perfect here; see airspace.position_noise_m"
        }
        _ => "this command is not known here",
    }
}
