import numpy as np
import pytest

from riseg_drake.stations.misbehaviour import Faults, UnreliableLink, Word, WordError, parse_word

MESSAGES = [str(k).encode() for k in range(2000)]
PERIOD = 0.01


def carried(seed=0, **faults):
    """What arrives of the messages sent every 10 ms, in its order."""
    link = UnreliableLink(np.random.default_rng(seed))
    link.faults = Faults(**faults)
    arrived = []
    for k, message in enumerate(MESSAGES):
        link.send(message, k * PERIOD)
        arrived += link.due(k * PERIOD)
    return arrived + link.due(np.inf)


def test_without_faults_every_message_arrives_at_once_and_in_order():
    assert carried() == MESSAGES


def test_the_share_that_was_asked_for_is_lost():
    arrived = carried(drop=0.1)
    assert len(arrived) == pytest.approx(1800, abs=50)  # 3.7 standard deviations
    assert arrived == sorted(arrived, key=int)


def test_duplicates_follow_their_original():
    arrived = carried(duplicate=0.1)
    assert len(arrived) == pytest.approx(2200, abs=50)
    assert arrived == sorted(arrived, key=int)


def test_a_reordered_message_arrives_right_after_its_successor():
    arrived = [int(message) for message in carried(reorder=0.1)]
    assert sorted(arrived) == list(range(2000))
    late = [k for k in range(1, 2000) if arrived[k] < arrived[k - 1]]
    assert len(late) == pytest.approx(180, abs=50)  # two in a row keep their order


def test_delays_are_spread_up_to_the_longest_and_make_messages_overtake():
    link = UnreliableLink(np.random.default_rng(0))
    link.faults.delay = 0.03
    for message in MESSAGES:
        link.send(message, 0.0)
    assert len(link.due(0.015)) == pytest.approx(1000, abs=90)
    assert 0.0 < link.next_arrival() - 0.015 < 1e-3
    assert len(link.due(0.0301)) == pytest.approx(1000, abs=90)
    assert link.next_arrival() == np.inf
    assert carried(delay=0.03) != MESSAGES


def test_the_same_seed_makes_the_same_faults():
    faults = {"drop": 0.1, "delay": 0.03, "duplicate": 0.1, "reorder": 0.1}
    assert carried(3, **faults) == carried(3, **faults)
    assert carried(3, **faults) != carried(4, **faults)


def test_a_stalled_sender_says_nothing_until_it_wakes():
    link = UnreliableLink(np.random.default_rng(0))
    link.obey(Word("images", "stall", 1.0), now=10.0)
    link.send(b"a", 10.5)
    assert (link.is_stalled(10.5), link.due(10.9)) == (True, [])
    link.send(b"b", 11.0)
    assert link.due(11.0) == [b"b"]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("images drop 0.1", Word("images", "drop", 0.1)),
        ("status  delay 0.03\n", Word("status", "delay", 0.03)),
        ("images stall 2", Word("images", "stall", 2.0)),
        ("reflex", Word("arm", "reflex")),
        ("stop", Word("arm", "stop")),
        ("recover", Word("arm", "recover")),
        ("die", Word("arm", "die")),
        ("die 2", Word("arm", "die", 2.0)),
        ("start", Word("arm", "start")),
        ("guide 1 -0.3", Word("arm", "guide", posture=(1.0, -0.3))),
        ("guide 0 0.1 0 -2 0 2 0.7", Word("arm", "guide", posture=(0, 0.1, 0, -2, 0, 2, 0.7))),
    ],
)
def test_words_are_understood(text, word):
    assert parse_word(text) == word


@pytest.mark.parametrize(
    "text",
    [
        "",
        "images",
        "images drop",
        "images drop 2",
        "images drop -1",
        "arm drop 0.1",
        "die soon",
        "guide 8 0.3",
        "guide 1",
        "guide 1 nan",
        "guide 1 2 3",
        "start 2",
    ],
)
def test_other_words_are_refused_in_one_line(text):
    with pytest.raises(WordError) as caught:
        parse_word(text)
    assert "\n" not in str(caught.value)
