"""The pages, made with NiceGUI. They read the model at their own pace, and keep nothing."""

from rosz.web.pages.registration import add_pages
