import os
from functools import partial

import pytest
import viser._viser
from builders import PATIENCE_S
from viewer_client import Client, Served, is_sent, late_joiner, make_estimate

from app.viewer.geometry import PinHit, WallHit
from app.viewer.pin import Pin


class Tunnels:
    """Stands in for the class that opens viser's public tunnel."""

    made = 0

    def __init__(self, *_: object) -> None:
        type(self).made += 1


@pytest.fixture
def tunnels(monkeypatch: pytest.MonkeyPatch) -> type[Tunnels]:
    monkeypatch.setattr(viser._viser, "ViserTunnel", Tunnels)
    monkeypatch.setattr(Tunnels, "made", 0)
    return Tunnels


def barrier(served: Served, client, mm: float = 33.0) -> list[dict]:
    """Messages until a pose posted now has come through."""
    served.scene.show(pose=make_estimate(mm))
    return client.until_robot_says(f"{mm / 1000:.3f} m")


def test_operator_clicks_the_wall(served: Served) -> None:
    served.scene.show(length_m=3)
    with served.client() as client:
        barrier(served, client)
        client.click((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        inside = served.clicks.get(timeout=PATIENCE_S)
        client.click((1.0, 3.0, 0.0), (0.1, -3.0, 0.0))
        outside = served.clicks.get(timeout=PATIENCE_S)

    assert inside == WallHit(pytest.approx(1.0), pytest.approx(3.0), pytest.approx(0.15))
    # From outside the near wall is not drawn: the far wall is what was clicked.
    assert outside == WallHit(pytest.approx(1.105), pytest.approx(9.0), pytest.approx(-0.15))


def test_operator_clicks_a_pin(served: Served) -> None:
    served.scene.show(pins=[Pin("a", 1.0, 3.0, 0.005, 2, "BAB")])
    with served.client() as client:
        barrier(served, client)
        client.click((1.0, -0.1, 0.0), (0.0, 1.0, 0.0))
        client.click((1.0, -0.1, 0.0), (0.0, -1.0, 0.0))
        hits = [served.clicks.get(timeout=PATIENCE_S) for _ in range(2)]

    assert hits == [PinHit("a"), WallHit(pytest.approx(1.0), pytest.approx(9.0), -0.15)]


def test_click_beside_the_culvert_is_nothing(served: Served) -> None:
    with served.client() as client:
        barrier(served, client)
        client.click((-5.0, 0.0, 0.0), (0.0, 1.0, 0.0))
        client.click((0.5, 0.0, 0.0), (0.0, 0.0, 1.0))
        first = served.clicks.get(timeout=PATIENCE_S)

    assert first.clock_h == pytest.approx(6.0)
    assert served.clicks.empty()


def test_click_of_a_viewer_is_dropped(served: Served) -> None:
    for role in ("viewer", "unheard-of"):
        served.role = role
        with served.client() as client:
            client.click((0.5, 0.0, 0.0), (0.0, 1.0, 0.0))
            client.send_camera()
            client.until(is_sent)

    assert served.clicks.empty()


def test_share_request_opens_no_tunnel(served: Served, tunnels: type[Tunnels]) -> None:
    for way in (served.client(), late_joiner(served.scene)):  # through the pump, and past it
        with way as client:
            client.send(type="ShareUrlRequest")
            client.send_camera()
            client.until(is_sent)

    assert tunnels.made == 0


def test_messages_off_the_list_are_dropped(served: Served) -> None:
    with served.client() as client:
        client.send(type="SceneNodeClickMessage", name="/robot")
        client.send(type="GuiUpdateMessage", uuid="x", updates={})
        client.send(type="RunJavascriptMessage", source="alert(1)")
        client.send(type="no such message")
        client.send_camera()
        client.until(is_sent)


IMPOSSIBLE = (
    {"position": (float("nan"), 0.0, 0.0)},
    {"look_at": (-1.0, 0.0, 0.0)},
    {"up_direction": (0.0, 0.0, 0.0)},
    {"wxyz": (0.0, 0.0, 0.0, 0.0)},
    {"image_height": 0},
    {"fov": "wide"},
    {"extra": 1},
)
"""Changes of a camera."""
MALFORMED = (b"", b"\xc1", b"\x81\xa4type\x01", b"\x93\x01\x02\x03", "hello")


def test_what_cannot_be_ends_its_own_connection_only(served: Served) -> None:
    senders = {str(changes): partial(Client.send_camera, **changes) for changes in IMPOSSIBLE}
    senders |= {repr(raw): lambda client, raw=raw: client.ws.send(raw) for raw in MALFORMED}
    senders["ray"] = partial(
        Client.click, origin=(float("inf"), 0.0, 0.0), direction=(0.0, 1.0, 0.0)
    )
    codes = {}
    with served.client() as other:
        for name, send in senders.items():
            with served.client() as client:
                send(client)
                codes[name] = client.close_code()
        other.send_camera()
        served.scene.show(mode="follow")
        barrier(served, other)

    assert codes == dict.fromkeys(senders, 1011)


def test_frame_of_three_megabytes_passes(served: Served) -> None:
    served.scene.show(preview=os.urandom(3_000_000))
    with served.client() as client:
        messages = client.until(lambda m: "_image_data" in m.get("updates", {}))

    assert messages


def test_view_of_a_closed_scene_says_try_again(served: Served) -> None:
    served.scene.close()
    with served.client() as client:
        assert client.close_code() == 1013
