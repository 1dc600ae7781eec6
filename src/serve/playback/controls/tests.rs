//! Tests of what is shown, unseen or held back around seeks, pauses and the end.

use super::*;

fn stamps(from: i64, n: i64) -> impl Iterator<Item = Nanos> + Clone {
    (from..from + n).map(|k| Nanos(k * 1_000_000))
}

#[test]
fn a_seek_forward_is_mute_up_to_its_stamp_and_then_shows() {
    let playback = Playback::new("f", Some(1000.0), false);
    assert!(matches!(playback.grant(stamps(0, 1)), (Grant::Show(1), _)));
    let mut stale = false;
    playback
        .ask(Action::Seek(Nanos(50_000_000)), &mut || stale = true)
        .unwrap();
    assert!(stale);
    assert_eq!(playback.grant(stamps(1, 100)).0, Grant::Mute(49));
    let (grant, notice) = playback.grant(stamps(50, 1));
    assert_eq!((grant, notice), (Grant::Show(1), Notice::Changed));
}

#[test]
fn a_seek_backward_ends_the_run_and_the_next_one_is_mute_up_to_its_stamp() {
    let playback = Playback::new("f", Some(1000.0), false);
    assert!(matches!(playback.grant(stamps(5, 5)), (Grant::Show(5), _)));
    let mut stale = false;
    playback
        .ask(Action::Seek(Nanos(7_000_000)), &mut || stale = true)
        .unwrap();
    assert!(stale);
    assert_eq!(playback.grant(stamps(10, 5)).0, Grant::End);
    assert!(!playback.ended(), "it is not the end");
    assert!(playback.wait_for_restart() && playback.begin_anew());
    assert_eq!(playback.grant(stamps(5, 5)).0, Grant::Mute(2));
    assert!(matches!(playback.grant(stamps(7, 1)), (Grant::Show(1), _)));
    assert_eq!(playback.run(), 1);
    playback.forward_only(Some("because"));
    let refused = playback
        .ask(Action::Seek(Nanos(0)), &mut || {})
        .unwrap_err();
    assert_eq!(refused.code, "forward_only");
}

#[test]
fn while_paused_nothing_goes_on_but_one_item_where_a_seek_has_led() {
    let playback = Playback::new("f", Some(1000.0), true);
    // That it waits, and where, is said first.
    assert_eq!(
        playback.grant(stamps(0, 9)),
        (Grant::Show(0), Notice::Begun)
    );
    assert_eq!(playback.position().unwrap().at, Some(Nanos(0)));
    playback
        .ask(Action::Seek(Nanos(3_000_000)), &mut || {})
        .unwrap();
    assert_eq!(playback.grant(stamps(0, 9)).0, Grant::Mute(3));
    assert_eq!(
        playback.grant(stamps(3, 6)),
        (Grant::Show(1), Notice::Changed)
    );
    playback.ask(Action::Play, &mut || {}).unwrap();
    assert!(matches!(playback.grant(stamps(4, 5)), (Grant::Show(5), _)));
}

#[test]
fn what_can_not_be_is_refused() {
    let unpaced = Playback::new("f", None, true);
    assert_eq!(
        unpaced.ask(Action::Pause, &mut || {}).unwrap_err().code,
        "not_paced"
    );
    assert_eq!(unpaced.position(), None);
    assert_eq!(unpaced.grant(stamps(0, 9)).0, Grant::Show(9));
    let playback = Playback::new("f", Some(1.0), false);
    for speed in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(
            playback.ask(Action::Speed(speed), &mut || {}).is_err(),
            "{speed}"
        );
    }
    assert!(
        playback.ask(Action::Seek(Nanos(0)), &mut || {}).is_err(),
        "no start yet"
    );
    playback.stop();
    assert_eq!(playback.grant(stamps(0, 9)).0, Grant::End);
    assert!(!playback.wait_for_restart());
}

#[test]
fn what_is_shown_after_a_seek_is_not_forgotten_with_what_came_before() {
    let playback = std::sync::Arc::new(Playback::new("f", Some(1.0), true));
    let (turn, _) = playback.grant(stamps(0, 10));
    assert_eq!(turn, Grant::Show(0));
    let run = playback.clone();
    let forgotten = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    let seen = forgotten.clone();
    let shown = std::thread::spawn(move || {
        while run.grant(stamps(0, 10)).0 != Grant::Show(1) {}
        seen.load(std::sync::atomic::Ordering::SeqCst)
    });
    std::thread::sleep(Duration::from_millis(20));
    let forget = || {
        std::thread::sleep(Duration::from_millis(50));
        forgotten.store(true, std::sync::atomic::Ordering::SeqCst);
    };
    playback
        .ask(Action::Seek(Nanos(0)), &mut || forget())
        .unwrap();
    assert!(shown.join().unwrap());
}
