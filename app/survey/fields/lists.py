"""Lists of values, with the letters and numbers that formats have for them.

The letters of EN 13508-2 are those of its Annex C, as public programs list them. U and G stand
before the numbers of ISYBAU's lists. A pattern finds the words that people type for a value.
"""

from __future__ import annotations

from app.survey.fields.declaration import Meaning, ValueList

DIRECTIONS = ValueList(
    Meaning("with_flow", "A", "O", "I O", wincan="D 1"),
    Meaning("against_flow", "B", "U", "G U", wincan="U 2"),
    Meaning("unknown", "C"),
)
"""AAK; of DWA-M 150 programs write I and G, or O and U."""
ASSET_TYPES = ValueList(
    Meaning("culvert", "E", "~KR", "~R", r"culvert|durchlass|pembetung"),
    Meaning("storm", "B", "KR", "R", r"storm|surface|regen|\b(kr|rw)\b|hujan"),
    Meaning("foul", "A", "KS", "S", r"foul|sanitary|schmutz|\bks\b|kumbahan"),
    Meaning("combined", "C", "KM", "M", r"comb|misch|\b(km|mw)\b|gabungan"),
    Meaning("drain", "", "~KR", "~R", r"drain|dr[aä]nage|parit|longkang"),
)
"""ACK, G101, HG302; culverts and drains are storm in the German lists."""
SHAPES = ValueList(
    Meaning("circular", "A", "0", "0", r"^(circ|round|kreis|rund|bulat)",
            "A C CIRCULAR ROUND KREIS KREISPROFIL"),
    Meaning("rectangular", "B", "3", "", r"rect|\bbox\b|rechteck|kasten|segi", "R B RECTANGULAR"),
    Meaning("egg", "C", "1", "", r"\begg|\bei(form\w*|profil)?\b|telur", "E EGG"),
    Meaning("arch", "E", pattern=r"\barch|bogen|maul|gerbang"),
    Meaning("u_shaped", "D", pattern=r"\bu\b"),
    Meaning("oval", "F", pattern=r"oval|ellip|bujur"),
    Meaning("other", "Z"),
)  # fmt: skip
"""ACA, G205, HG305, of which only the circle is known."""
END_CONDITIONS = ValueList(Meaning("complete"), Meaning("abandoned"))
PURPOSES = ValueList(
    Meaning("first_survey", "", "1"),
    Meaning("routine", "C", "2", "1"),
    Meaning("acceptance", "A", "3", "2"),
    Meaning("end_of_warranty", "B", "4", "3"),
    Meaning("follow_up", "", "5"),
    Meaning("before_repair", "", "6"),
    Meaning("after_repair", "G", "7", "5"),
)
"""ABP, U101, HI004."""
METHODS = ValueList(
    Meaning("camera", "B", "0", "2 0 1"),
    Meaning("walk_through", "A", "1"),
    Meaning("from_end_only", "C", "2"),
)
"""ABE, U108, HI103, which names the kind of camera."""
LENGTH_SOURCES = ValueList(Meaning("drawing"), Meaning("tape"), Meaning("survey"))
CLEANED = ValueList(
    Meaning(True, "A", "1 true", "J"),
    Meaning(False, "B", "0 false", "N"),
)
MATERIALS = ValueList(
    Meaning("asbestos cement", "AA", "AZ", "AZ", r"asbest"),
    Meaning("fibre cement", "AK", "FZ", "FZ", r"fib(re|er) cement|faserzement"),
    Meaning("sprayed concrete", "AI", "", "", r"sprayed|shotcrete|spritzbeton"),
    Meaning("polymer concrete", "", "", "", r"polymer"),
    Meaning("concrete segments", "AJ", "BS", "BS", r"segment"),
    Meaning("reinforced concrete", "AH", "SB", "SB",
            r"reinforced|bertetulang|\brcp?\b|\brcc\b|stahlbeton"),
    Meaning("concrete", "AG", "B", "B", r"concrete|konkrit|beton"),
    Meaning("brick", "AD", "~MA", "~MA", r"brick|\bbata\b|ziegel|klinker"),
    Meaning("masonry", "", "MA", "MA", r"masonry|stone\b|batu\b|mauerwerk"),
    Meaning("masonry", "AR AS"),
    Meaning("vitrified clay", "AE", "STZ", "STZ",
            r"clay|stoneware|vitrified|tanah liat|steinzeug|\bvcp?\b"),
    Meaning("ductile iron", "AO", "GGG", "GGG", r"ductile|duktil|\bdip?\b"),
    Meaning("grey cast iron", "AN", "~GG", "~GG", r"gr[ea]y (cast )?iron|grauguss"),
    Meaning("cast iron", "AM", "GG", "GG", r"cast iron|gusseisen|\bcip?\b"),
    Meaning("steel", "AP", "ST", "ST", r"steel|keluli|corrugated metal|\bcmp\b|stahl"),
    Meaning("HDPE", "~AV", "PEHD", "PEHD", r"hdpe"),
    Meaning("polyethylene", "AV", "PE", "PE", r"polyethylene|\bpe\b"),
    Meaning("polypropylene", "AW", "PP", "PP", r"polypropylene|\bpp\b"),
    Meaning("PVC-U", "AX", "PVCU", "PVCU", r"pvc"),
    Meaning("glass-fibre plastics", "AL", "GFK", "GFK", r"\bgrp\b|\bgfk\b|glass"),
    Meaning("unknown", "AZ", "", "", r"unknown|not known|tidak diketahui"),
)  # fmt: skip
"""ACD and ACF, G102."""
LININGS = ValueList(
    Meaning("factory made", "A", pattern=r"factory|manufactur|kilang"),
    Meaning("sprayed", "B", pattern=r"spray|gunite|shotcrete"),
    Meaning("cured in place", "C", pattern=r"cured|cipp|\bliner\b"),
    Meaning("segments", "D", pattern=r"segment"),
    Meaning("discrete pipes", "E", pattern=r"discrete"),
    Meaning("continuous pipe", "F", pattern=r"slip|continuous"),
    Meaning("close fit", "G", pattern=r"close.?fit"),
    Meaning("spiral wound", "H", pattern=r"spiral"),
)
"""ACE."""
WEATHER = ValueList(
    Meaning("snow or ice melting", "C", "3", "4", r"snow|melt|thaw"),
    Meaning("dry", "A", "1", "1", r"\b(dry|sun|sunny|clear|fine|no rain|kering|cerah)\b"),
    Meaning("rain", "B", "2", "2", r"rain|shower|wet|hujan"),
    Meaning("frost", "", "", "3", r"\bfrost\b"),
)
"""ADA, U106, HI106."""
FLOW_CONTROL = ValueList(
    Meaning("none", "A", "1", "1", r"^(none|no|nil|tiada)\b"),
    Meaning("blocked upstream", "B", "2", "2", r"upstream|hulu"),
    Meaning("partly blocked", "C", "3", "3", r"part"),
    Meaning("laterals blocked", "", "4", "4", r"lateral"),
    Meaning("backwater", "", "5", "5", r"backwater"),
)
"""ADC, U107."""
REFERENCE_POINTS = ValueList(
    Meaning(
        "centre of the start manhole", "C", "1", "1", r"cent(re|er).*(manhole|chamber|shaft)"
    ),
    Meaning(
        "inner face of the wall at the start", "A", "2", "2",
        r"inner (face|wall)|headwall|inside face",
    ),
    Meaning(
        "crown of the pipe at the start", "B", "3", "3", r"(crown|end) of (the )?pipe|pipe end"
    ),
    Meaning("half way along the channel at the start", "D", "4", "4", r"half ?way"),
)  # fmt: skip
"""ABC, U105."""
GROUNDS = ValueList(
    Meaning("client waives", isybau="AV", pattern=r"client|waive"),
    Meaning("aim reached", isybau="ZE", pattern=r"(aim|target|goal) (was |is )?reached"),
    Meaning("reached from the other side", isybau="GE", pattern=r"(?<!not )reached from the other"),
    Meaning("not possible from there", isybau="IN", pattern=r"not possible from"),
)
"""Why a survey was abandoned, U134; GN, the far end was not reached, needs no words."""
