"""Camera intrinsics from pictures of a checkerboard or a ChArUco board.

- `boards`: the printed board, and its view in a picture.
- `finding`: detects the board in each picture, and measures how sharp it is.
- `lens`: one least-squares fit of a camera to the boards found.
- `fitting`: fits, rejects outliers and fits again; the result and its verdict.
- `report`: draws the part of the picture that the boards covered, and the residuals.
"""
