"""Does the study of the live page see a run to its end, and lose nothing of it?"""

from tests.benchmarks.live_page import folder_of, lost, watch


def test_a_run_that_is_looked_at_is_recorded_whole_and_seen_to_its_end() -> None:
    with folder_of(40.0) as folder:
        seen = watch(folder)
        recorded, _, size, *_ = lost(folder).split()
    assert recorded == size == "2065000"
    assert seen[-1].share == 1.0
    assert max(look.pictures for look in seen) > 0
    assert all(look.page_mb > 0.0 for look in seen)
