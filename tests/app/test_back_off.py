from app.back_off import BackOff


def test_pauses_double_up_to_the_longest():
    back_off = BackOff(first_s=0.2, longest_s=2.0)
    assert [back_off.pause_s(failures) for failures in range(6)] == [0.2, 0.4, 0.8, 1.6, 2.0, 2.0]


def test_however_often_it_failed_there_is_a_pause():
    assert BackOff(first_s=2.0, longest_s=3600.0).pause_s(10**9) == 3600.0
