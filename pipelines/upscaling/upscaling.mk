# Up-scaling: blocks at each confinement -> averages -> calibrated law -> slope. Included by the Makefile.
# Each stage leaves NAME.nc and NAME.json (its headline numbers); VTU and PVD files lie beside them.

UP           := $(RESULTS)/upscaling
UP_SCENES    := pipelines/upscaling
# 0.1 MPa for the ground near a surface; the first one is the confinement of the REV study.
CONFINING    ?= 0.5 1 2 4 0.1
UP_RADIUS    ?= 4 m
UP_RUNS      := $(CONFINING:%=$(UP)/blocks-%MPa.nc)
UP_CURVES    := $(CONFINING:%=$(UP)/curves-%MPa.nc)
# A representative size needs several tessellations: the first confinement again with other seeds than the scene's own.
UP_SEEDS     ?= 2 3
UP_REV_RUNS  := $(firstword $(UP_RUNS)) $(UP_SEEDS:%=$(UP)/blocks-seed%.nc)
UP_PICTURES  := $(UP)/blocks-$(firstword $(CONFINING))MPa.png $(UP)/rev-study.png \
                $(UP)/calibration.png $(UP)/calibration-udec.png $(UP)/slope.png $(UP)/slope-blocks.png \
                $(UP)/slope-compared.png
UP_ARTIFACTS := $(UP_RUNS) $(UP_CURVES) $(UP)/rev-study.nc $(UP)/calibration.nc $(UP)/calibration-udec.nc \
                $(UP)/slope.nc $(UP)/slope-blocks.nc
# A draft takes blocks of twice the size: a minute instead of ten.
COARSE       := --set 'tessellation.edge="1 m"' --set 'tessellation.shortest_edge="0.48 m"' \
                --set 'tessellation.rounding="0.1 m"'

.PHONY: upscaling
upscaling: $(UP)/summary.json $(UP_PICTURES) ## the up-scaling chain: blocks, averages, law, slope

# Rewritten only when the fidelity changes, so that a change of it reruns the chain.
$(UP)/.fidelity: FORCE
	+@mkdir -p $(@D); [ "$$(cat $@ 2>/dev/null)" = "$(FIDELITY)" ] || echo "$(FIDELITY)" > $@

.PHONY: FORCE
FORCE:

# $(call stage,COMMAND): run a stage for target $@ and keep its headline numbers beside it.
define stage
	@mkdir -p $(@D)
	$(BIN)/$(1) -o $@ --overwrite --json > $(@:.nc=.json.part)
	@mv $(@:.nc=.json.part) $(@:.nc=.json)
endef

$(UP)/blocks-%MPa.nc: $(UP_SCENES)/voronoi-granite.toml $(UP)/.fidelity | $(READY)
	$(call stage,dem-run $< --set fidelity=$(FIDELITY) --set 'loading.confining_pressure="$* MPa"')

$(UP)/curves-%MPa.nc: $(UP)/blocks-%MPa.nc
	$(call stage,homogenize $< --radius "$(UP_RADIUS)")

$(UP)/blocks-seed%.nc: $(UP_SCENES)/voronoi-granite.toml $(UP)/.fidelity | $(READY)
	$(call stage,dem-run $< --set fidelity=$(FIDELITY) --set seed=$* --set output.vtk=false \
	  --set 'loading.confining_pressure="$(firstword $(CONFINING)) MPa"')

$(UP)/rev-study.nc: $(UP_SCENES)/rev-study.toml $(UP_REV_RUNS)
	$(call stage,rev-study $(UP_REV_RUNS) --scene $<)

$(UP)/calibration.nc: $(UP_SCENES)/calibrate.toml $(UP_CURVES)
	$(call stage,calibrate $< $(UP_CURVES) --set fidelity=$(FIDELITY))

$(UP)/calibration-udec.nc: $(UP_SCENES)/calibrate-udec.toml $(UP_SCENES)/reference/udec_voronoi_granite_fit.csv | $(READY)
	$(call stage,calibrate $<)

$(UP)/slope.nc: $(UP_SCENES)/slope.toml $(UP)/calibration.nc
	$(call stage,fem-run $< --material $(UP)/calibration.material.toml --set fidelity=$(FIDELITY))

$(UP)/slope-blocks.nc: $(UP_SCENES)/slope-blocks.toml $(UP)/.fidelity | $(READY)
	$(call stage,dem-run $< --set fidelity=$(FIDELITY) $(if $(filter draft,$(FIDELITY)),$(COARSE)))

$(UP)/slope-compared.png: $(UP_SCENES)/slope_compare.py $(UP)/slope-blocks.nc $(UP)/slope.nc $(UP)/slope-band.json
	$(BIN)/python $< $(UP)/slope-blocks.nc --continuum $(UP)/slope.nc --band $(UP)/slope-band.json -o $@

# The reference that fem-run is judged against: all 12,360 blocks.
$(RESULTS)/verify/slope.nc: $(UP_SCENES)/slope-blocks.toml | $(READY)
	$(call stage,dem-run $< --set numerics.threads=$(JOBS) --set numerics.steps=200000)

.PHONY: slope
slope: $(RESULTS)/verify/slope.nc ## the slope of 12,360 blocks and its failure load (14 CPU minutes); results/verify/slope.json
	$(BIN)/python $(UP_SCENES)/slope_compare.py $< -o $(<:.nc=.png)

$(UP)/slope-band.json: $(UP_SCENES)/slope_band.py $(UP)/slope.nc
	$(BIN)/python $< $(UP)/calibration.nc $(UP_SCENES)/slope.toml --own $(UP)/slope.json --fidelity $(FIDELITY) -o $@

$(UP)/%.png: $(UP)/%.nc
	$(BIN)/graben show $< -o $@ --overwrite -q

$(UP)/summary.json: $(UP_ARTIFACTS) $(UP)/slope-band.json pipelines/summary.py
	$(BIN)/python pipelines/summary.py write upscaling $(@D)
