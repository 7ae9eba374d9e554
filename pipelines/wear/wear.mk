# Wear: a bed of grains on the tool, a scratch by one grain, both combined. Included by the Makefile.

WEAR           := $(RESULTS)/wear
WEAR_SCENES    := pipelines/wear
WEAR_PICTURES  := $(WEAR)/bed.png $(WEAR)/scratch.png $(WEAR)/astm-g65-mixtures.png
WEAR_ARTIFACTS := $(WEAR)/bed.nc $(WEAR)/scratch.nc $(WEAR)/astm-g65-mixtures.nc $(WEAR)/own-bed-and-groove.nc

.PHONY: wear
wear: $(WEAR)/summary.json $(WEAR_PICTURES) ## the wear chain: bed, scratch, wear rate

$(WEAR)/.fidelity: FORCE
	+@mkdir -p $(@D); [ "$$(cat $@ 2>/dev/null)" = "$(FIDELITY)" ] || echo "$(FIDELITY)" > $@

$(WEAR)/bed.nc: $(WEAR_SCENES)/bed.toml $(WEAR)/.fidelity | $(READY)
	$(call stage,dem-run $< --set fidelity=$(FIDELITY))

$(WEAR)/scratch.nc: $(WEAR_SCENES)/scratch.toml $(WEAR)/.fidelity | $(READY)
	$(call stage,scratch $< --set fidelity=$(FIDELITY))

$(WEAR)/astm-g65-mixtures.nc: $(WEAR_SCENES)/astm-g65-mixtures.toml | $(READY)
	$(call stage,wear-estimate $<)

$(WEAR)/own-bed-and-groove.nc: $(WEAR_SCENES)/own-bed-and-groove.toml $(WEAR)/bed.nc $(WEAR)/scratch.nc
	$(call stage,wear-estimate $< --bed $(WEAR)/bed.nc --scratch grains=$(WEAR)/scratch.nc)

$(WEAR)/%.png: $(WEAR)/%.nc
	$(BIN)/graben show $< -o $@ --overwrite -q

$(WEAR)/summary.json: $(WEAR_ARTIFACTS) pipelines/summary.py
	$(BIN)/python pipelines/summary.py write wear $(@D)
