/** A declaration to begin with: what a file beside a model says about it. */

export const EXAMPLE = `name: crack-net
task: segment            # or: detect
input: [512, 512]        # width and height of its input, px
mm_per_px: 1.0           # size of a pixel on the wall that it was trained for
overlap: 0.2             # of neighbouring tiles, as a share
colours: rgb             # or: bgr, grey
mean: [123.7, 116.3, 103.5]
scale: [0.0171, 0.0175, 0.0174]
output: logits           # or: probabilities, labels; of boxes: rows, columns
threshold: 0.5           # least score of a proposal
least_mm: 20             # smaller regions are left out
classes:                 # in the order of the output
  - kind: null           # the background
  - kind: crack
    code: BAB
    char1: B
`;
