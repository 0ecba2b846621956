"""Who made the document and when, as PDF/A-2a and PDF/UA-1 demand it, and its colour space."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from xml.sax.saxutils import escape

from PIL import ImageCms

from app.reports.pdf.file import File, dictionary, reference

PROGRAM = "Chainage"

_XMP = """<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/">
<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description rdf:about=""
 xmlns:dc="http://purl.org/dc/elements/1.1/"
 xmlns:xmp="http://ns.adobe.com/xap/1.0/"
 xmlns:pdf="http://ns.adobe.com/pdf/1.3/"
 xmlns:pdfaid="http://www.aiim.org/pdfa/ns/id/"
 xmlns:pdfuaid="http://www.aiim.org/pdfua/ns/id/"
 xmlns:pdfaExtension="http://www.aiim.org/pdfa/ns/extension/"
 xmlns:pdfaSchema="http://www.aiim.org/pdfa/ns/schema#"
 xmlns:pdfaProperty="http://www.aiim.org/pdfa/ns/property#">
<pdfaid:part>2</pdfaid:part>
<pdfaid:conformance>A</pdfaid:conformance>
<pdfuaid:part>1</pdfuaid:part>
<dc:format>application/pdf</dc:format>
<dc:title><rdf:Alt><rdf:li xml:lang="x-default">{title}</rdf:li></rdf:Alt></dc:title>
<dc:creator><rdf:Seq><rdf:li>{author}</rdf:li></rdf:Seq></dc:creator>
<dc:description><rdf:Alt><rdf:li xml:lang="x-default">{subject}</rdf:li></rdf:Alt></dc:description>
<dc:language><rdf:Bag><rdf:li>{language}</rdf:li></rdf:Bag></dc:language>
<xmp:CreatorTool>{program}</xmp:CreatorTool>
<xmp:CreateDate>{date}</xmp:CreateDate>
<xmp:ModifyDate>{date}</xmp:ModifyDate>
<xmp:MetadataDate>{date}</xmp:MetadataDate>
<pdf:Producer>{program}</pdf:Producer>
<pdfaExtension:schemas><rdf:Bag><rdf:li rdf:parseType="Resource">
<pdfaSchema:schema>PDF/UA identification schema</pdfaSchema:schema>
<pdfaSchema:namespaceURI>http://www.aiim.org/pdfua/ns/id/</pdfaSchema:namespaceURI>
<pdfaSchema:prefix>pdfuaid</pdfaSchema:prefix>
<pdfaSchema:property><rdf:Seq><rdf:li rdf:parseType="Resource">
<pdfaProperty:name>part</pdfaProperty:name>
<pdfaProperty:valueType>Integer</pdfaProperty:valueType>
<pdfaProperty:category>internal</pdfaProperty:category>
<pdfaProperty:description>Part of ISO 14289 that the file conforms to</pdfaProperty:description>
</rdf:li></rdf:Seq></pdfaSchema:property>
</rdf:li></rdf:Bag></pdfaExtension:schemas>
</rdf:Description>
</rdf:RDF>
</x:xmpmeta>
<?xpacket end="w"?>"""

_MADE_AT = slice(24, 36)
"""Bytes of a colour profile that hold when it was made: equal reports have equal files."""


@dataclass(frozen=True)
class About:
    """What a file states about itself."""

    title: str
    author: str
    subject: str
    language: str
    """A code of two letters."""
    made_at: datetime

    def info(self, file: File) -> Mapping[str, object]:
        """Return the entries of the information dictionary."""
        date = f"(D:{self.made_at.astimezone(UTC):%Y%m%d%H%M%SZ})"
        return {
            "Title": file.text(self.title), "Author": file.text(self.author),
            "Subject": file.text(self.subject), "Creator": f"({PROGRAM})",
            "Producer": f"({PROGRAM})", "CreationDate": date, "ModDate": date,
        }  # fmt: skip

    def write(self, file: File) -> Mapping[str, object]:
        """Write metadata and colour space; return their entries of the catalogue."""
        metadata, intent, profile = file.take(), file.take(), file.take()
        file.put_stream(metadata, self._xmp(), Type="/Metadata", Subtype="/XML", Filter=None)
        file.put_stream(profile, _srgb(), N=3)
        file.put(intent, dictionary({
            "Type": "/OutputIntent", "S": "/GTS_PDFA1", "Info": "(sRGB IEC61966-2.1)",
            "OutputConditionIdentifier": "(sRGB IEC61966-2.1)",
            "DestOutputProfile": reference(profile),
        }))  # fmt: skip
        return {
            "Metadata": reference(metadata),
            "OutputIntents": b"[%s]" % reference(intent),
            "Lang": f"({self.language})",
            "ViewerPreferences": "<</DisplayDocTitle true>>",
            "MarkInfo": "<</Marked true>>",
        }

    def _xmp(self) -> bytes:
        texts = {name: escape(getattr(self, name)) for name in ("title", "author", "subject")}
        date = f"{self.made_at.astimezone(UTC):%Y-%m-%dT%H:%M:%SZ}"
        made = _XMP.format(**texts, language=self.language, program=PROGRAM, date=date)
        return made.encode("utf-8")


@cache
def _srgb() -> bytes:
    profile = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    # 2000-01-01 00:00:00
    profile[_MADE_AT] = bytes((7, 208, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0))
    return bytes(profile)
