"""A rig from a film of a camera that looks along a pipe of known diameter.

- `tracks`: points of the wall, followed through a part of the film.
- `flow`: a first guess of drive and vanishing point, by the flow of the points.
- `lens`: the lens that is sought, and what is known of it beforehand.
- `scene`: where a lens sees the points of a part from its views.
- `bundle`: least squares of lens, views and points over all parts.
- `refine`: measures the points again on patches bent as the wall is seen.
- `scale`: the focal length by the inspected length or by joints.
- `calibrate`: all of it together, the rig, and what the film does not show.
- `report`: draws the wall's grid on the film.
"""
