"""How fast hizvk is, as ratios to yardsticks of the same run: ``make bench-speed``.

From a checkout with the module built for release: ``python -m tools.speed``.

- `town`: the synthetic scene, in which the hidden share of a crowd is a parameter
- `rounds`: all ways in turns
- `figures`: what was measured, beside the targets
- `run`: what the parts below share
- `reduction`: the depth pyramid against a memcpy and one dispatch per level
- `depth_in`: multisampled depth, and rectangles that have changed
- `mips`: mip textures of depth against the pyramid
- `culling`: certified, uncertified and grouped culls; what each output costs
- `counts`: counts of pixels against the cull without them
- `errors`: what the culls keep, against the float64 oracle
- `calls`: what Python adds; small calls; numpy and Embree
- `occluders`: the host's rasteriser against the device's, and conservative depth
- `bounds`: few and many bounds, by the whole call from meshes to a mask
- `transfers`: uploads, updates, and when sorting again pays
- `memory`: bytes on the device, and the peak on the host (`host_peak`)
- `first_call`: fresh processes (`first_mask`) with the driver's shader cache cold and warm, and
  their first frames (`first_frame`) with and without a warm-up
- `scale`: time, memory and texels against the numbers of instances and pixels
- `report`: report.json (its schema stands there), report.md; `plots` draws the scale
- `command`: the command line
"""
