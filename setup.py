"""The long description of the package: the README without links into the checkout, which lead nowhere elsewhere."""

import re
from pathlib import Path

from setuptools import setup

ELSEWHERE = r"\((?!https://)[^)]*\)"
text = Path(__file__).with_name("README.md").read_text("utf-8")
text = re.sub(rf"!\[[^\]]*\]{ELSEWHERE}\n*", "", text)  # pictures
text = re.sub(rf"\[([^\]]*)\]{ELSEWHERE}", r"\1", text)

setup(long_description=text, long_description_content_type="text/markdown")
