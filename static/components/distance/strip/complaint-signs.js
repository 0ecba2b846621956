/** A sign for each kind of complaint about the picture, drawn on a 20 x 20 grid. */

const SIGNS = {
  too_fast: 'M3 4l6 6-6 6M10 4l6 6-6 6',
  too_dark: 'M13 3a7.500 7.500 0 1 0 4 11a6.500 6.500 0 0 1-4-11z',
  too_bright:
    'M10 6.500a3.500 3.500 0 1 0 .01 0zM10 1.500v2M10 16.500v2M1.500 10h2M16.500 10h2M4 4l1.400 1.400M14.600 14.600L16 16M4 16l1.400-1.400M14.600 5.400L16 4',
  blurred: 'M3 5h10M6 10h11M3 15h8',
  lens_dirty: 'M10 2.500c3.500 4.500 5 6.500 5 9a5 5 0 0 1-10 0c0-2.500 1.500-4.500 5-9z',
};

const paths = new Map();

/** Draws the sign with its corner at (x, y), `size` units wide. */
export function drawComplaint(context, name, x, y, size, colour) {
  if (!paths.has(name)) paths.set(name, new Path2D(SIGNS[name]));
  context.save();
  context.translate(x, y);
  context.scale(size / 20, size / 20);
  context.strokeStyle = colour;
  context.lineWidth = 2.2;
  context.lineCap = 'round';
  context.lineJoin = 'round';
  context.stroke(paths.get(name));
  context.restore();
}
