//! Ways to a cycle that follow each other faster than they are completed.

use super::*;

#[test]
fn steps_that_are_asked_for_faster_than_they_are_gone_add_up() {
    let (mut page, _) = Page::open(&ROBOTS.replace("cycles = 600", "cycles = 100000"), 1);
    let steps: Vec<u32> =
        (0..12).map(|_| page.send(json!({ "do": "step", "cycles": 1000 }))).collect();
    for id in steps {
        assert_eq!(page.wait(id)["answer"]["is"], "done");
    }
    page.until("the last cycle", |page| {
        let last = page.notices.iter().rfind(|notice| notice["notice"] == "status")?;
        (last["state"] == "paused" && last["cycle"] == 12_000.0).then_some(())
    });
}
